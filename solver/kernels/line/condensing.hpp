#pragma once
// Dynamic condensation of spans, Schur complements at frequencies, to the unknowns that they share
// with their neighbours. See half_lines.py.
#include "base/arrays.hpp"
#include "base/complex.hpp"

namespace catenary {

/// Fill `taken` (n, k, k) with beside^T inverse(bands) beside, with `weights` (n, 3) of M, C and K
/// in each; see `SpanMatrices`. L D L^T without pivots: with waves that fade, all leading blocks
/// are those of damped lines.
void condense_spans(Array2<const Complex> weights, Array3<const double> bands,
                    Array3<const double> beside, Array3<Complex> taken);

}  // namespace catenary
