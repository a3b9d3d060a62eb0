// The Python module catenary.solver.kernels.native: one function for each folder of kernels.
#include "base/compiler.hpp"
#include "python/from_python.hpp"

namespace catenary::python {

void offer_base(py::module_& module);
void offer_stations(py::module_& module);
void offer_line(py::module_& module);
void offer_motion(py::module_& module);
void offer_loads(py::module_& module);
void offer_contact(py::module_& module);
void offer_contact_problem(py::module_& module);
void offer_schemes(py::module_& module);
void offer_steps(py::module_& module);
void offer_views(py::module_& module);
void offer_heads(py::module_& module);
void offer_multibody(py::module_& module);

PYBIND11_MODULE(native, module) {
    module.doc() = "Kernels of the time loop, compiled from C++.";
    py::class_<Bound>(module, "Bound", "A kernel with its first arguments.")
        .def("__call__", &Bound::call);
    py::class_<Kernel>(module, "Kernel", "A function over arrays and records.")
        .def("__call__", &Kernel::call)
        .def("bound", &Kernel::bound)
        .def("__repr__", [](const Kernel& kernel) { return kernel.name + ": " + kernel.does; });
    offer_base(module);
    offer_stations(module);
    offer_line(module);
    offer_motion(module);
    offer_loads(module);
    offer_contact(module);
    offer_contact_problem(module);
    offer_schemes(module);
    offer_steps(module);
    offer_views(module);
    offer_heads(module);
    offer_multibody(module);
}

}  // namespace catenary::python
