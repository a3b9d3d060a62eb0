#pragma once
// Where elimination from both ends meets, and how that station is moved. See station_factors.py.
#include "base/arrays.hpp"
#include "base/record.hpp"

namespace catenary {

/// Spacing of the stations where elimination may end, if it may at several.
constexpr int64_t kMiddles = 16;

/// Kinds of stations by where elimination ends: `to_end` (n,) if that is further on, `to_start`
/// (n,) if it is before; `here` of each station where it may end, one of kMiddles.
struct Turning {
    std::span<const int32_t> to_end, to_start, here;
    CATENARY_RECORD(to_end, to_start, here)
    CATENARY_SHAPES("n, n, *")
};

/// A station where elimination may end, near the middle from `low` to `high`.
int64_t middle_of(int64_t low, int64_t high);
/// Move the end of elimination from `before` to `middle`.
void turn(std::span<int32_t> kinds, const Turning& turning, int64_t before, int64_t middle);

}  // namespace catenary
