#pragma once
// Short columns of A^-1 cut out of answers to unit forces. See unit_responses.py.
#include "base/arrays.hpp"
#include "base/record.hpp"

namespace catenary {

/// What is wanted of the answers of n places, among unknowns of a stretch of the line.
struct Cuts {
    std::span<const int64_t> low, high;     ///< it is to be zero before and from there on
    std::span<const int64_t> begin, width;  ///< what is wanted
    std::span<const int64_t> at;            ///< where that goes
    CATENARY_RECORD(low, high, begin, width, at)
};

/// Put the part of each answer that is wanted into `data`; what is outside of windows relative to
/// the peak, at most. Of each place `answers` (n k, m) has k rows.
double cut_out(Array2<const double> answers, const Cuts& cuts, std::span<double> data);

}  // namespace catenary
