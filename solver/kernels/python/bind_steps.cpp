// What Python calls of steps.
#include "python/from_python.hpp"
#include "steps/steps.hpp"

namespace catenary::python {

namespace {

/// Steps, and what they are made of.
class HeldSteps : public Steps {
  public:
    HeldSteps(const py::object& parts, const py::object& block, Kept kept = {})
        : Steps(From<StepParts>::convert(parts, "parts", kept),
                From<Block>::convert(block, "block", kept)),
          kept_(std::move(kept)) {}

  private:
    Kept kept_;
};

}  // namespace

void offer_steps(py::module_& module) {
    PYBIND11_NUMPY_DTYPE(Counts, rounds, slack, repeated);
    module.attr("COUNTS") = py::dtype::of<Counts>();
    py::class_<Taken>(module, "Taken")
        .def_readonly("n_steps", &Taken::n_steps)
        .def_readonly("begun", &Taken::begun)
        .def_readonly("is_full", &Taken::is_full);
    py::class_<HeldSteps>(module, "Steps")
        .def(py::init([](const py::object& parts, const py::object& block) {
            return std::make_unique<HeldSteps>(parts, block);
        }))
        .def("take",
             [](HeldSteps& steps, int64_t first, int64_t end) { return steps.take(first, end); });
}

}  // namespace catenary::python
