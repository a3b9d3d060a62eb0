// The Python module catenary.solver.kernels.native.
#include <pybind11/pybind11.h>

#include "compiler.hpp"

PYBIND11_MODULE(native, module) {
    module.doc() = "Kernels of the time loop, compiled from C++.";
}
