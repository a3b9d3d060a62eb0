#pragma once
// Outputs of a rank's part of a line after a step.
#include <algorithm>
#include <vector>

#include "motion/links.hpp"

namespace catenary {

/// Columns of several tables by the stations that they follow from; see moving_columns.py.
struct Columns {
    std::span<const int64_t> ends;    ///< first station that moves and the one after the last
    std::span<const int64_t> starts;  ///< (n + 1,) first unknown of each station
    /// Of each of k tables (n + 1, k) the first column that follows from a station or from one
    /// behind it, and the column after the last one that follows from stations before it.
    Array2<const int32_t> first, last;
    CATENARY_RECORD(ends, starts, first, last)
    CATENARY_SHAPES("2.., n+1, n+1 3, n+1 3")
};

/// Columns of the tables, as ``Shown`` has them.
enum ShownTable { kArms, kDroppers, kOthers };

struct Shown {
    Motion motion;
    std::span<const int64_t> arms;  ///< unknowns of vertical displacement at steady arms
    Links droppers, others;         ///< droppers, and all other links
    Dependents dropper_bends, other_bends;
    std::span<double> other_force;  ///< room for the forces of the latter [N]
    Columns columns;                ///< of arms, droppers and others
    CATENARY_RECORD(motion, arms, droppers, others, dropper_bends, other_bends, other_force,
                    columns)
    CATENARY_SHAPES("*, a, n=d, *, n=d, *, *, *")
};

/// Displacement at arms [m] and forces of droppers and of other links [N], as far as they follow
/// from stations from `begin` to `end`.
void show(const Shown& shown, std::span<double> uplift, std::span<double> dropper_force,
          int64_t begin, int64_t end);

/// Extend a range of `stations`, first and last + 1, by another one.
inline void take_in(std::span<int64_t> stations, std::span<const int64_t> moving) {
    stations[0] = std::min(stations[0], moving[0]);
    stations[1] = std::max(stations[1], moving[1]);
}

/// Motions kept of steps from which a march may be resumed; see KeptMotions.
struct KeptMotions {
    std::span<const int64_t> motion_of;  ///< number of the motion that keeps a step, -1 if none
    std::span<double> numbers;  ///< room for displacements and velocities, a motion after another
    Array2<int64_t> stations;   ///< of each motion the first, the last + 1, where its numbers begin
    std::span<int64_t> used;    ///< (1,) how much of the room is
    std::span<int64_t> moved;   ///< stations that have moved since the motion before
    std::vector<std::span<const double>> places;  ///< numbers that are kept with a motion
    Array2<double> kept_places;                   ///< (n_motions, n) room for these
    CATENARY_RECORD(motion_of, numbers, stations, used, moved, places, kept_places)
    CATENARY_SHAPES("n, *, m 3, 1?, 2?, *, m *")
};

/// Keep the motion of a step as that of a number; whether there is room for it.
bool keep(const KeptMotions& kept, int64_t number, const Motion& motion, const Columns& columns);

/// Copy arrays one after another.
inline void copy_all(const std::vector<std::span<const double>>& arrays, std::span<double> result) {
    int64_t at = 0;
    for (const auto& array : arrays) {
        std::ranges::copy(array, part(result, at, at + size(array)).begin());
        at += size(array);
    }
}

}  // namespace catenary
