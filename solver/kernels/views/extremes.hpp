#pragma once
// Extremes of what steps have shown.
#include "base/arrays.hpp"

namespace catenary {

/// Let `kept` (2, n), smallest and largest, take in columns from `begin` to `end` of a channel,
/// whose first one is `first` of the rows (m, k).
void take_extremes(Array2<const double> rows, int64_t first, int64_t begin, int64_t end,
                   Array2<double> kept);

}  // namespace catenary
