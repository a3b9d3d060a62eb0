// The Python module catenary.solver.kernels.native, with the bindings of arithmetic, of curves and
// of the line: its motion, its loads, and the preparation of a march.
#include "base/curves.hpp"
#include "base/flush_to_zero.hpp"
#include "base/targets.hpp"
#include "loads/loads.hpp"
#include "motion/motion.hpp"
#include "motion/two_passes.hpp"
#include "python/from_python.hpp"

namespace catenary::python {

void offer_stations(py::module_& module);
void offer_contact(py::module_& module);
void offer_steps(py::module_& module);
void offer_heads(py::module_& module);

namespace {

void offer_base(py::module_& module) {
    module.def("flush_subnormals", &flush_subnormals);
    module.def("restore_subnormals", &restore_subnormals, py::arg("before"));
    offer(module, "spline_at", spline_at, "n>1, n-1 4");
    offer(module, "tables_at", tables_at, "m=m, *, m, m");
    offer(module, "sines_at", sines_at, "n, n, n");
    offer(module, "polyline_at", polyline_at, "n>0, n, s, s, s");
}

void offer_line(py::module_& module) {
    offer_records<Motion, StepFactors, Columns, Shown, Window, Changing, Sampled, Loads,
                  MemoryTables, Memories, Links, Dependents>(module);
    CATENARY_OFFER_TYPE(module, "RESERVE", Reserve, rest, stiffness, damping, place, released,
                        carried);
    offer(module, "predict", predict, "n, n, n, n?, n");
    offer(module, "correct", correct, "n, n, n");
    offer(module, "displacements", displacements, "");
    offer(module, "velocities", velocities, "");
    offer(module, "reserves", reserves, "*, n=n, n");
    offer(module, "energy_of_switching", energy_of_switching, "*, n=n, n=n");
    module.attr("LEAST_STATIONS") = kLeastStations;
    offer(module, "turn_to", turn_to, "");
    offer(module, "keep", keep, "m=m, *, *, *");
    offer(module, "show", show, "a=a d=d, a, d");

    CATENARY_OFFER_TYPE(module, "FACTOR", Factor, kind, begin, end, value);
    CATENARY_OFFER_TYPE(module, "SAMPLED_LOAD", SampledLoad, first, last, times, samples, held);
    CATENARY_OFFER_TYPE(module, "END_MEMORY", EndMemory, width, n_steps, levels, past, sums, near,
                        spectra, done, dt);
    module.attr("NEAR") = kNear;
    offer(module, "evaluate", evaluate, "");
    offer(module, "recall", recall, "");
    offer(module, "fourier_forth", fourier_forth, "n>0, n..");

    offer(module, "condense_spans", condense_spans, "z 3, 3 n b>0, 3 n k, z k k");
    offer(module, "add_waves", add_waves, "s k, k m, s m");
}

}  // namespace

PYBIND11_MODULE(native, module) {
    module.doc() = "Kernels of the time loop, compiled from C++.";
    py::class_<Bound>(module, "Bound", "A kernel with its first arguments.")
        .def("__call__", [](const Bound& own, const py::args& later) { return own.call(later); });
    py::class_<Kernel>(module, "Kernel", "A function over arrays and records.")
        .def("__call__", &Kernel::call)
        .def("bound", &Kernel::bound)
        .def("__repr__", [](const Kernel& kernel) { return kernel.name + ": " + kernel.shapes; });
    offer_base(module);
    offer_stations(module);
    offer_line(module);
    offer_contact(module);
    offer_steps(module);
    offer_heads(module);
}

}  // namespace catenary::python
