// Python bindings of marches side by side.
#include <algorithm>

#include "ensemble/ensemble.hpp"
#include "python/from_python.hpp"

namespace catenary::python {

namespace {

/// Numbers of scenes, ascending, that kernels step side by side on a line of these layouts.
std::vector<int> scenes_at_once(const std::vector<std::pair<Layout, Layout>>& layouts) {
    std::vector<int> found;
    for (const int scenes : {kScenes, kMostScenes})
        if (std::ranges::all_of(layouts, [scenes](const auto& of) {
                return kernels_for_scenes(of.first, of.second, scenes) != nullptr;
            }))
            found.push_back(scenes);
    return found;
}

}  // namespace

void offer_ensemble(py::module_& module) {
    offer_records<LineExtremes>(module);
    module.def("scenes_at_once", &scenes_at_once, py::arg("layouts"));
    py::class_<ScenePasses, std::shared_ptr<ScenePasses>>(module, "ScenePasses")
        .def(made_of<ScenePasses, PassParts>("parts"))
        .def("track", taking(&ScenePasses::track, "links", "rest", "reserves"))
        .def("rest", &ScenePasses::rest)
        .def("step", &ScenePasses::step);
    py::class_<Ensemble>(module, "Ensemble")
        .def(made_of<Ensemble, std::shared_ptr<ScenePasses>, LineExtremes>("passes", "extremes"))
        .def("begin", &Ensemble::begin, py::arg("lane"), py::arg("steps").none(false), py::arg("n"))
        .def("take", &Ensemble::take)
        .def("at", [](const Ensemble& own, int64_t lane) {
            return std::pair(own.at(lane).next, own.at(lane).is_left);
        });
}

}  // namespace catenary::python
