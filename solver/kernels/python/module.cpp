// The Python module catenary.solver.kernels.native, with what Python calls of arithmetic and
// curves.
#include "base/compiler.hpp"
#include "base/curves.hpp"
#include "base/flush_to_zero.hpp"
#include "python/from_python.hpp"

namespace catenary::python {

void offer_stations(py::module_& module);
void offer_line(py::module_& module);
void offer_contact(py::module_& module);
void offer_steps(py::module_& module);
void offer_heads(py::module_& module);
void offer_ensemble(py::module_& module);

namespace {

void offer_base(py::module_& module) {
    module.def("flush_subnormals", &flush_subnormals);
    module.def("restore_subnormals", &restore_subnormals, py::arg("before"));
    offer(module, "spline_at", spline_at, "Value and two derivatives of a cubic spline.");
    offer(module, "tables_at", tables_at, "Fill in values and slopes of splines over one axis.");
    offer(module, "sines_at", sines_at, "Value and two derivatives of a sum of sines.");
    offer(module, "polyline_at", polyline_at, "Fill in values and slopes of a line at places.");
}

}  // namespace

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
    offer_contact(module);
    offer_steps(module);
    offer_heads(module);
    offer_ensemble(module);
}

}  // namespace catenary::python
