// What Python calls to judge a step.
#include "python/from_python.hpp"
#include "schemes/step_error.hpp"

namespace catenary::python {

void offer_schemes(py::module_& module) {
    offer(module, "step_error", step_error, "Largest error of a contact force by a step [N].");
    offer(module, "accept_step", accept_step, "Append a step to those of the past.");
}

}  // namespace catenary::python
