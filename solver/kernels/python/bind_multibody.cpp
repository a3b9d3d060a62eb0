// What Python calls of multibody systems.
#include "multibody/joints_and_lines.hpp"
#include "python/from_python.hpp"

namespace catenary::python {

void offer_multibody(py::module_& module) {
    PYBIND11_NUMPY_DTYPE(BodyProduct, body, start, end, between, normal, at_start, at_end);
    PYBIND11_NUMPY_DTYPE(BodyLine, i, j, at_i, at_j);
    module.attr("BODY_PRODUCT") = py::dtype::of<BodyProduct>();
    module.attr("BODY_LINE") = py::dtype::of<BodyLine>();
    offer(module, "rotation_matrices", rotation_matrices,
          "Fill in matrices from body to space axes of unit Euler parameters.");
    offer(module, "move_bodies", move_bodies, "Displace and turn bodies in place.");
    offer(module, "add_gyroscopic_moments", add_gyroscopic_moments,
          "Add -omega x J omega to generalised forces in place.");
    offer(module, "body_products", body_products,
          "Fill in scalar products of vectors of bodies with their derivatives.");
    offer(module, "body_lines", body_lines,
          "Fill in lengths between points of bodies, their rates and gradients.");
    offer(module, "independent_rows", independent_rows,
          "Numbers of rows that are not combinations of rows before them.");
}

}  // namespace catenary::python
