// Python bindings of marches side by side.
#include <algorithm>

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
    void rest(int64_t lane) {
        if (lane < 0 || lane >= n()) throw py::index_error("there is no such lane");
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
               From<LineExtremes>::convert(extremes, "extremes", kept_)),
          of_lanes_(passes.cast<ScenePasses&>().n()) {}

    void begin(int64_t lane, const py::object& steps, int64_t n) {
        own_.begin(lane, steps.cast<Steps&>(), n);
        of_lanes_.at(lane) = steps;
    }
    void take(int64_t most) { own_.take(most); }
    py::tuple at(int64_t lane) const {
        const March& march = own_.at(lane);
        return py::make_tuple(march.next, march.is_left);
    }

  private:
    Kept kept_;
    py::object passes_;
    Ensemble own_;
    std::vector<py::object> of_lanes_;
};

/// Numbers of scenes, ascending, that kernels step side by side on a line of these layouts.
std::vector<int> scenes_at_once(const std::vector<Layout>& rows,
                                const std::vector<Layout>& factors) {
    std::vector<int> found;
    for (const int scenes : {kScenes, kMostScenes}) {
        const auto are_compiled = [&](const Layout& of_rows, const Layout& of_factors) {
            return kernels_for_scenes(of_rows, of_factors, scenes) != nullptr;
        };
        if (std::ranges::equal(rows, factors, are_compiled)) found.push_back(scenes);
    }
    return found;
}

}  // namespace

void offer_ensemble(py::module_& module) {
    module.def("scenes_at_once", &scenes_at_once);
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
