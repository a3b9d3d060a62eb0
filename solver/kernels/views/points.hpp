#pragma once
// Points of what steps have shown.
#include "base/arrays.hpp"

namespace catenary {

/// Fill in points of rows (m, k), one row after another: of row i those from first[i] on, count[i]
/// of them. A point takes the number at its one of `columns`, or zero where that is below zero.
void take_points(Array2<const double> rows, std::span<const int64_t> columns,
                 std::span<const int64_t> first, std::span<const int64_t> count,
                 std::span<double> result);

}  // namespace catenary
