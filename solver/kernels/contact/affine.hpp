#pragma once
// Heights at contacts as functions of contact forces.
#include "base/arrays.hpp"
#include "base/record.hpp"

namespace catenary {

/// Heights and their rates at n contacts: `place` (n,) [m] and `rate` (n,) [m/s] without forces,
/// `by_force` (n, n) [m/N] and `rate_by_force` (n, n) [m/(N s)]: their increase by forces
/// for a line, their decrease for heads and depths.
struct Affine {
    std::span<double> place, rate;
    Array2<double> by_force, rate_by_force;
    CATENARY_RECORD(place, rate, by_force, rate_by_force)
    CATENARY_SHAPES("n, n, n n, n n")
};

}  // namespace catenary
