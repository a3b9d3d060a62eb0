// What Python calls of what steps have shown.
#include "python/from_python.hpp"
#include "views/extremes.hpp"
#include "views/points.hpp"

namespace catenary::python {

void offer_views(py::module_& module) {
    offer(module, "take_extremes", take_extremes, "Take columns of rows into extremes.");
    offer(module, "take_points", take_points, "Fill in points of rows, one row after another.");
}

}  // namespace catenary::python
