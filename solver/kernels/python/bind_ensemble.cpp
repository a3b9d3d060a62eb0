// Python bindings of marches side by side.
#include "ensemble/ensemble.hpp"
#include "python/from_python.hpp"

namespace catenary::python {

namespace {

PassParts parts_of(const std::vector<Layout>& rows, const std::vector<Layout>& factors,
                   const py::object& parts, Kept& kept) {
    auto convert = [&]<class Record>(const char* name, Record& record) {
        record = From<Record>::convert(parts.attr(name), name, kept);
    };
    PassParts found;
    for (size_t k = 0; k < rows.size(); ++k) found.layouts.emplace_back(rows[k], factors.at(k));
    convert("station_types", found.station_types);
    convert("rows", found.rows);
    convert("factors", found.factors);
    convert("arrays", found.arrays);
    convert("changes", found.changes);
    return found;
}

/// An ensemble, with all that it is made of.
class HeldEnsemble {
  public:
    HeldEnsemble(const std::vector<Layout>& rows, const std::vector<Layout>& factors,
                 const py::object& parts, const py::object& extremes)
        : passes_(parts_of(rows, factors, parts, kept_)),
          own_(passes_, From<LineExtremes>::convert(extremes, "extremes", kept_)) {}

    void track(const py::object& tracked, const py::object& rest, const py::object& reserves) {
        Kept kept;
        passes_.track(From<TrackedLinks>::convert(tracked, "links", kept),
                      From<Array2<const double>>::convert(rest, "rest", kept),
                      From<std::vector<std::span<double>>>::convert(reserves, "reserves", kept));
        of_links_ = std::move(kept);
    }
    void begin(int lane, const py::object& steps, int64_t n) {
        if (lane < 0 || lane >= kScenes) throw py::index_error("there is no such lane");
        own_.begin(lane, steps.cast<Steps&>(), n);
        of_lanes_[lane] = steps;
    }
    void take(int64_t most) { own_.take(most); }
    void rest(int lane) {
        if (lane < 0 || lane >= kScenes) throw py::index_error("there is no such lane");
        passes_.rest(lane);
    }
    py::tuple at(int lane) const {
        const March& march = own_.at(lane);
        return py::make_tuple(march.next, march.is_left);
    }

  private:
    Kept kept_, of_links_;
    std::array<py::object, kScenes> of_lanes_;
    ScenePasses passes_;
    Ensemble own_;
};

bool are_compiled_for_scenes(const Layout& rows, const Layout& factors) {
    return kernels_for_scenes(rows, factors) != nullptr;
}

}  // namespace

void offer_ensemble(py::module_& module) {
    module.attr("SCENES") = kScenes;
    module.def("are_compiled_for_scenes", &are_compiled_for_scenes, py::arg("rows"),
               py::arg("factors"));
    py::class_<HeldEnsemble>(module, "Ensemble")
        .def(py::init<std::vector<Layout>, std::vector<Layout>, py::object, py::object>())
        .def("track", &HeldEnsemble::track)
        .def("rest", &HeldEnsemble::rest)
        .def("begin", &HeldEnsemble::begin)
        .def("take", &HeldEnsemble::take)
        .def("at", &HeldEnsemble::at);
}

}  // namespace catenary::python
