#pragma once
// Short columns of A^-1 cut out of answers to unit forces. See unit_responses.py.
#include "base/arrays.hpp"

namespace catenary {

/// Windows of answers to forces at n places, among unknowns of a stretch of the line; (n,) each.
struct Cuts {
    std::span<const int64_t> low, high;     ///< the answer is to be zero before and from there on
    std::span<const int64_t> begin, width;  ///< part that is copied
    std::span<const int64_t> at;            ///< where it goes in `data`
    CATENARY_RECORD(low, high, begin, width, at)
    CATENARY_SHAPES("n, n, n, n, n")
};

/// Copy the wanted part of each answer into `data`. `answers` (n k, m) has k rows for each place.
/// Returns the largest magnitude outside of a window, relative to its answer's peak.
double cut_out(Array2<const double> answers, const Cuts& cuts, std::span<double> data);

}  // namespace catenary
