#pragma once
// Wires across the track.
#include "base/arrays.hpp"
#include "base/record.hpp"

namespace catenary {

/// Lateral motion of wires at n contacts: place y + v [m], its total rate
/// dv/dt + V (dy/dx + dv/dx) [m/s] and displacement v [m]. Empty without lateral motion.
struct Across {
    std::span<double> place, rate, moved;
    CATENARY_RECORD(place, rate, moved)
    CATENARY_SHAPES("n, n, n")
};

}  // namespace catenary
