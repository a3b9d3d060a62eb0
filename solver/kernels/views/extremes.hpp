#pragma once
// Extremes and points of the outputs of steps.
#include "base/arrays.hpp"

namespace catenary {

/// Take into `kept` (2, n), smallest and largest, the columns from `begin` to `end` of a channel,
/// whose first one is `first` of the rows (m, k).
void take_extremes(Array2<const double> rows, int64_t first, int64_t begin, int64_t end,
                   Array2<double> kept);

/// Fill in points of rows (m, k), one row after another: of row i count[i] points from first[i]
/// on. A point takes the number at its one of `columns`, or zero where that is below zero.
void take_points(Array2<const double> rows, std::span<const int64_t> columns,
                 std::span<const int64_t> first, std::span<const int64_t> count,
                 std::span<double> result);

}  // namespace catenary
