#pragma once
// Zeros of continuous maps without derivatives: Merrill's path of simplices.
//
// O. H. Merrill, Applications and extensions of an algorithm that computes fixed points of certain
// upper semi-continuous point to set mappings, dissertation, University of Michigan (1972); E. L.
// Allgower and K. Georg, Numerical continuation methods, Springer (1990), chapters 12 and 13.
//
// The space and a level between 0 and 1 are cut into simplices (Freudenthal's triangulation), all
// with their corners on the two levels. On level 0 stands z - start, on level 1 the map, between
// them the function that is linear in each simplex. Its zeros are a path that starts at the one on
// level 0. It cannot come back there, so it arrives at level 1 where the map points away from a
// point on a large sphere around it. Finer grids from there on, each with a path of its own, leave
// a zero as exact as wanted.
#include <functional>

#include "contact_problem/active_set.hpp"

namespace catenary {

/// A continuous map of R^n to itself: fills in the value at z; none of it need be a number.
using Map = std::function<void(std::span<const double> z, std::span<double> value)>;

/// Find a zero of a map that is known to less than `small`, and for which (z - start) . of(z) > 0
/// for all z that are far from the start.
///
/// `z` holds where to begin, and then the last place evaluated; the better, the shorter the path.
/// `width` is that of the first grid, in units of z; a largest component of `small` counts as zero.
/// Returns whether the place is a zero: not if the path is too long, or the map no number on it.
/// `room` is for 2 n unknowns at least.
bool find_zero(const Map& of, std::span<double> z, double width, double small, const Room& room);

}  // namespace catenary
