// What Python calls of loads in time.
#include "loads/fourier.hpp"
#include "loads/loads.hpp"
#include "python/from_python.hpp"

namespace catenary::python {

void offer_loads(py::module_& module) {
    PYBIND11_NUMPY_DTYPE(Factor, kind, begin, end, value);
    PYBIND11_NUMPY_DTYPE(SampledLoad, first, last, times, samples, held);
    PYBIND11_NUMPY_DTYPE(EndMemory, width, n_steps, levels, past, sums, near, spectra, done, dt);
    module.attr("FACTOR") = py::dtype::of<Factor>();
    module.attr("SAMPLED_LOAD") = py::dtype::of<SampledLoad>();
    module.attr("END_MEMORY") = py::dtype::of<EndMemory>();
    module.attr("NEAR") = kNear;
    offer(module, "evaluate", evaluate, "Make the values of loads those at the time of a clock.");
    offer(module, "recall", recall, "Make up for steps whose accelerations are in the past.");
    offer(module, "fourier_forth", fourier_forth,
          "Fourier transform in place, numbers in the order of reversed bits.");
}

}  // namespace catenary::python
