// The Python module catenary.solver.kernels.native: one function for each folder of kernels.
#include "base/compiler.hpp"
#include "python/from_python.hpp"

namespace catenary::python {

void offer_stations(py::module_& module);
void offer_motion(py::module_& module);

PYBIND11_MODULE(native, module) {
    module.doc() = "Kernels of the time loop, compiled from C++.";
    py::class_<Bound>(module, "Bound", "A kernel with its first arguments.")
        .def("__call__", &Bound::call);
    py::class_<Kernel>(module, "Kernel", "A function over arrays and records.")
        .def("__call__", &Kernel::call)
        .def("bound", &Kernel::bound)
        .def("__repr__", [](const Kernel& kernel) { return kernel.name + ": " + kernel.does; });
    offer_stations(module);
    offer_motion(module);
}

}  // namespace catenary::python
