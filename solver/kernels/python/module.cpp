// The Python module catenary.solver.kernels.native, with the bindings of arithmetic, of curves and
// of the line: its motion, its loads, and the preparation of a march.
#include "base/compiler.hpp"
#include "base/curves.hpp"
#include "base/flush_to_zero.hpp"
#include "line/condensing.hpp"
#include "line/gusts.hpp"
#include "line/short_columns.hpp"
#include "loads/fourier.hpp"
#include "loads/loads.hpp"
#include "motion/links.hpp"
#include "motion/shown.hpp"
#include "motion/window.hpp"
#include "python/from_python.hpp"

namespace catenary::python {

void offer_stations(py::module_& module);
void offer_contact(py::module_& module);
void offer_steps(py::module_& module);
void offer_heads(py::module_& module);
void offer_ensemble(py::module_& module);

namespace {

void offer_base(py::module_& module) {
    module.def("flush_subnormals", &flush_subnormals);
    module.def("restore_subnormals", &restore_subnormals, py::arg("before"));
    offer(module, "spline_at", spline_at, "Value and two derivatives of a cubic spline.");
    offer(module, "tables_at", tables_at, "Fill in values and slopes of splines over one axis.");
    offer(module, "sines_at", sines_at, "Value and two derivatives of a sum of sines.");
    offer(module, "polyline_at", polyline_at, "Fill in values and slopes of a line at places.");
}

void offer_line(py::module_& module) {
    PYBIND11_NUMPY_DTYPE(Reserve, rest, stiffness, damping, place, released, carried);
    module.attr("RESERVE") = py::dtype::of<Reserve>();
    offer(module, "predict", predict, "Predictions of Newmark's method in place.");
    offer(module, "correct", correct, "New displacement and velocity from predictions.");
    offer(module, "predict_alpha", predict_alpha,
          "Predictions of the generalized-alpha method in place.");
    offer(module, "displacements", displacements, "Fill in displacements.");
    offer(module, "velocities", velocities, "Fill in velocities.");
    offer(module, "reserves", reserves, "Fill in the reserve of each link until it switches [N].");
    offer(module, "energy_of_switching", energy_of_switching,
          "Elastic energy that links add where they have switched [J].");
    module.attr("LEAST_STATIONS") = kLeastStations;
    offer(module, "turn_to", turn_to, "Let steps of a window take on some stations.");
    offer(module, "take_in", take_in, "Let a range of stations take in another one.");
    offer(module, "show", show, "Displacements at arms, and forces of links.");

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

    offer(module, "condense_spans", condense_spans,
          "Condense spans to the unknowns that they share, at frequencies.");
    offer(module, "cut_out", cut_out, "Short columns out of answers to unit forces.");
    offer(module, "bridge", bridge, "Fill in amplitudes of gusts between two posts.");
    offer(module, "add_waves", add_waves, "Add waves times amplitudes.");
}

}  // namespace

PYBIND11_MODULE(native, module) {
    module.doc() = "Kernels of the time loop, compiled from C++.";
    py::class_<Bound>(module, "Bound", "A kernel with its first arguments.")
        .def("__call__", &Bound::call);
    py::class_<Kernel>(module, "Kernel", "A function over arrays and records.")
        .def("__call__", &Kernel::call)
        .def("bound", &Kernel::bound)
        .def("__repr__", [](const Kernel& kernel) { return kernel.name + ": " + kernel.does; });
    offer_base(module);
    offer_stations(module);
    offer_line(module);
    offer_contact(module);
    offer_steps(module);
    offer_heads(module);
    offer_ensemble(module);
}

}  // namespace catenary::python
