// Python bindings of marches side by side.
#include "ensemble/ensemble.hpp"
#include "python/from_python.hpp"

namespace catenary::python {

namespace {

bool are_compiled_for_scenes(const Layout& rows, const Layout& factors, int scenes) {
    return kernels_for_scenes(rows, factors, scenes) != nullptr;
}

}  // namespace

void offer_ensemble(py::module_& module) {
    offer_records<LineExtremes>(module);
    module.attr("SCENES") = kScenes;
    module.attr("MOST_SCENES") = kMostScenes;
    module.def("are_compiled_for_scenes", &are_compiled_for_scenes, py::arg("rows"),
               py::arg("factors"), py::arg("scenes") = kScenes);
    py::class_<ScenePasses, std::shared_ptr<ScenePasses>>(module, "ScenePasses")
        .def(made_of<ScenePasses, PassParts>("parts"))
        .def("track", taking(&ScenePasses::track, "links", "rest", "reserves"))
        .def("rest", &ScenePasses::rest)
        .def("step", &ScenePasses::step);
    py::class_<Ensemble>(module, "Ensemble")
        .def(made_of<Ensemble, std::shared_ptr<ScenePasses>, LineExtremes>("passes", "extremes"))
        .def("begin", &Ensemble::begin, py::arg("lane"), py::arg("steps").none(false), py::arg("n"))
        .def("take", &Ensemble::take)
        .def("at", [](const Ensemble& own, int lane) {
            return std::pair(own.at(lane).next, own.at(lane).is_left);
        });
}

}  // namespace catenary::python
