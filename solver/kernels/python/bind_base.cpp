// What Python calls of arithmetic and curves.
#include "base/curves.hpp"
#include "base/flush_to_zero.hpp"
#include "python/from_python.hpp"

namespace catenary::python {

void offer_base(py::module_& module) {
    module.def("flush_subnormals", &flush_subnormals);
    module.def("restore_subnormals", &restore_subnormals, py::arg("before"));
    offer(module, "spline_at", spline_at, "Value and two derivatives of a cubic spline.");
    offer(module, "tables_at", tables_at, "Fill in values and slopes of splines over one axis.");
    offer(module, "sines_at", sines_at, "Value and two derivatives of a sum of sines.");
    offer(module, "polyline_at", polyline_at, "Fill in values and slopes of a line at places.");
}

}  // namespace catenary::python
