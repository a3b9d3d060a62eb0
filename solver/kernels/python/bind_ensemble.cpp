// Python bindings of marches side by side.
#include "ensemble/ensemble.hpp"
#include "python/pass_parts.hpp"

namespace catenary::python {

namespace {

/// Steps of several scenes that keep their arrays alive.
class HeldScenePasses : public ScenePasses {
  public:
    HeldScenePasses(PassParts parts, Kept kept)
        : ScenePasses(std::move(parts)), kept_(std::move(kept)) {}
    static std::unique_ptr<HeldScenePasses> made(const std::vector<Layout>& rows,
                                                 const std::vector<Layout>& factors,
                                                 const py::object& parts) {
        Kept kept;
        PassParts found = pass_parts(rows, factors, parts, kept);
        return std::make_unique<HeldScenePasses>(std::move(found), std::move(kept));
    }
    void track(const py::object& tracked, const py::object& rest, const py::object& reserves) {
        Kept kept;
        ScenePasses::track(
            From<TrackedLinks>::convert(tracked, "links", kept),
            From<Array2<const double>>::convert(rest, "rest", kept),
            From<std::vector<std::span<double>>>::convert(reserves, "reserves", kept));
        of_links_ = std::move(kept);
    }
    void rest(int lane) {
        if (lane < 0 || lane >= kScenes) throw py::index_error("there is no such lane");
        ScenePasses::rest(lane);
    }

  private:
    Kept kept_, of_links_;
};

/// An ensemble, with all that it is made of.
class HeldEnsemble {
  public:
    HeldEnsemble(const py::object& passes, const py::object& extremes)
        : passes_(passes),
          own_(passes.cast<ScenePasses&>(),
               From<LineExtremes>::convert(extremes, "extremes", kept_)) {}

    void begin(int lane, const py::object& steps, int64_t n) {
        if (lane < 0 || lane >= kScenes) throw py::index_error("there is no such lane");
        own_.begin(lane, steps.cast<Steps&>(), n);
        of_lanes_[lane] = steps;
    }
    void take(int64_t most) { own_.take(most); }
    py::tuple at(int lane) const {
        const March& march = own_.at(lane);
        return py::make_tuple(march.next, march.is_left);
    }

  private:
    Kept kept_;
    py::object passes_;
    std::array<py::object, kScenes> of_lanes_;
    Ensemble own_;
};

bool are_compiled_for_scenes(const Layout& rows, const Layout& factors, int scenes) {
    return kernels_for_scenes(rows, factors, scenes) != nullptr;
}

}  // namespace

void offer_ensemble(py::module_& module) {
    module.attr("SCENES") = kScenes;
    module.attr("MOST_SCENES") = kMostScenes;
    module.def("are_compiled_for_scenes", &are_compiled_for_scenes, py::arg("rows"),
               py::arg("factors"), py::arg("scenes") = kScenes);
    py::class_<ScenePasses>(module, "SceneSteps").def("step", &ScenePasses::step);
    py::class_<HeldScenePasses, ScenePasses>(module, "ScenePasses")
        .def(py::init(&HeldScenePasses::made))
        .def("track", &HeldScenePasses::track)
        .def("rest", &HeldScenePasses::rest);
    py::class_<HeldEnsemble>(module, "Ensemble")
        .def(py::init<py::object, py::object>())
        .def("begin", &HeldEnsemble::begin)
        .def("take", &HeldEnsemble::take)
        .def("at", &HeldEnsemble::at);
}

}  // namespace catenary::python
