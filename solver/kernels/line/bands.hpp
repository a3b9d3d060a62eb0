#pragma once
// Solves with a band matrix for many right sides at once. See operator_bands.py.
#include "base/arrays.hpp"

namespace catenary {

/// Answers to right sides (n, m), in place, of a symmetric matrix with lower `bands` (k, m), whose
/// entry (i, j) is in row j + i of column j; false if it is not positive definite. L D L^T by
/// columns.
bool solve_bands(Array2<const double> bands, Array2<double> right);

}  // namespace catenary
