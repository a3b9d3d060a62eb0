#pragma once
// Block LU factors of a line, station by station, with Schur complements S as pivots; and how the
// station moves where elimination from both ends meets. See station_factors.py.
#include <vector>

#include "base/arrays.hpp"

namespace catenary {

/// Blocks of a symmetric matrix in a row of stations, one of each kind of station: the block with
/// the station before, its own, and the block with the station after, (k, b, b) each.
struct StationBlocks {
    Array3<const double> before, own, after;
    CATENARY_RECORD(before, own, after)
    CATENARY_SHAPES("k b b, k b b, k b b")
};

/// Stations after elimination from one end.
struct Eliminated {
    std::vector<double> factors;   ///< (m, 2, b, b), see `Part`
    std::vector<int32_t> kinds;    ///< (m,) kind of station that each factor is of
    std::vector<int32_t> numbers;  ///< (n,) the factor of each station
};

/// Eliminate stations of these `kinds` one after the other, from the first or from the last on.
Eliminated eliminate(std::span<const int32_t> kinds, const StationBlocks& blocks, bool from_end);

/// Where elimination from both ends meets: the kind of the station, and the factors of the stations
/// before and after it, -1 if there is none.
struct Meeting {
    int64_t kind, before, after;
};

/// Fill in S^-1 of the factors (2 m, b, b) of meetings, part by part, whose neighbours have the
/// factors `before` and `after`.
void join(std::span<const Meeting> meetings, const StationBlocks& blocks,
          Array3<const double> before, Array3<const double> after, Array3<double> factors);

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
