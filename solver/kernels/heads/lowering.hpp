#pragma once
// A pantograph that is lowered under way until it is caught. See mbs/lowering.py.
#include "base/arrays.hpp"
#include "base/record.hpp"

namespace catenary {

/// Of the strips' mean over what catches them.
struct LoweringMemory {
    double height;     ///< now [m]
    double caught_at;  ///< where it is caught [m], known from the lowering on
    double phase;      ///< 0 before the lowering, 1 while it goes on, 2 when the head is caught
};

struct Lowering {
    double time;                       ///< after which it begins [s]
    double drop;                       ///< of the head until it is caught [m]
    std::span<LoweringMemory> memory;  ///< (1,)
    CATENARY_RECORD(time, drop, memory)
};

}  // namespace catenary
