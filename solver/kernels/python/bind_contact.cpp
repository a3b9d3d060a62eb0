// What Python calls of contacts.
#include "contact/contacts.hpp"
#include "contact/outputs.hpp"
#include "contact/response.hpp"
#include "contact/train_places.hpp"
#include "python/from_python.hpp"

namespace catenary::python {

void offer_contact(py::module_& module) {
    PYBIND11_NUMPY_DTYPE(Node, x, y, rest, at, begin, width, local, owned, joined);
    PYBIND11_NUMPY_DTYPE(Sample, x, height, slope);
    PYBIND11_NUMPY_DTYPE(Touch, first, end, half_length, present, x, element, local, value, slope,
                         whole_value, whole_slope, rest, samples, sample, surface, filled);
    PYBIND11_NUMPY_DTYPE(Flags, rows, stop, broken, missing);
    module.attr("NODE") = py::dtype::of<Node>();
    module.attr("SAMPLE") = py::dtype::of<Sample>();
    module.attr("TOUCH") = py::dtype::of<Touch>();
    module.attr("FLAGS") = py::dtype::of<Flags>();
    module.attr("SLIP") = kSlip;
    offer(module, "locate", locate, "Make touches those at some places.");
    offer(module, "place", place, "Look where contacts are and what answers to forces there.");
    offer(module, "heights", heights,
          "Fill in wire heights [m] and total rates [m/s] at contacts.");
    offer(module, "find_across", find_across, "Fill in where wires are across the track.");
    offer(module, "respond", respond, "Fill in a rank's share of the small problem.");
    offer(module, "superpose", superpose, "Add the answers to contact forces.");
    offer(module, "compensate", compensate, "Add the answers to compensations of links.");
    offer(module, "begin_work", begin_work, "Keep velocities at contacts before a step.");
    offer(module, "add_work", add_work, "Add the work of contact forces in a step.");
    offer(module, "move_contacts", move_contacts, "Move contacts and pantographs along the track.");
    offer(module, "write_outputs", write_outputs, "Fill in what a step shows of pantographs.");
}

}  // namespace catenary::python
