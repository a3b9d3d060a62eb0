// What Python calls of the motion of a line.
#include "motion/links.hpp"
#include "motion/shown.hpp"
#include "motion/window.hpp"
#include "python/from_python.hpp"

namespace catenary::python {

void offer_motion(py::module_& module) {
    PYBIND11_NUMPY_DTYPE(Reserve, rest, stiffness, damping, place, released, carried);
    module.attr("RESERVE") = py::dtype::of<Reserve>();
    offer(module, "predict", predict, "Predictions of Newmark's method in place.");
    offer(module, "correct", correct, "New displacement and velocity from predictions.");
    offer(module, "predict_alpha", predict_alpha,
          "Predictions of the generalized-alpha method in place.");
    offer(module, "displacements", displacements, "Fill in displacements.");
    offer(module, "velocities", velocities, "Fill in velocities.");
    offer(module, "reserves", reserves, "Fill in what is left to each link until it switches [N].");
    offer(module, "energy_of_switching", energy_of_switching,
          "What elastic energy lacks where links have switched [J].");
    module.attr("LEAST_STATIONS") = kLeastStations;
    offer(module, "turn_to", turn_to, "Let steps of a window take on some stations.");
    offer(module, "take_in", take_in, "Let a range of stations take in another one.");
    offer(module, "show", show, "Displacements at arms, and forces of links.");
}

}  // namespace catenary::python
