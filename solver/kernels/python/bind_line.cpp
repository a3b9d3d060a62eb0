// What Python calls before a march, and as it makes gusts.
#include "line/condensing.hpp"
#include "line/gusts.hpp"
#include "line/short_columns.hpp"
#include "python/from_python.hpp"

namespace catenary::python {

void offer_line(py::module_& module) {
    offer(module, "condense_spans", condense_spans,
          "Fill in what spans take off the unknowns that they share, at frequencies.");
    offer(module, "cut_out", cut_out, "Short columns out of answers to unit forces.");
    offer(module, "bridge", bridge, "Fill in amplitudes of gusts between two posts.");
    offer(module, "add_waves", add_waves, "Add waves times amplitudes.");
}

}  // namespace catenary::python
