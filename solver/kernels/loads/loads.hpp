#pragma once
// Loads in time on the unknowns that a rank solves for, see line_loads.py; amplitudes of
// gusts along a line, and the waves that they make, see wind.py.
#include "loads/ends.hpp"

namespace catenary {

/// Kinds of `TimeFunction`.
enum : int64_t { kConstant, kTable, kHarmonics };

/// A function of time, with its value at the latest time. Its numbers are the ones from `begin` to
/// before `end`, see `TimeFunction`.
struct Factor {
    int64_t kind, begin, end;
    double value;
};

/// Forces that change: `constant` and, at each place that changes, terms of factors. These are rows
/// of a sparse matrix, from begins[j] to begins[j + 1] for place j.
struct Changing {
    std::span<const int64_t> places, begins, terms;
    std::span<const double> forces;  ///< of a unit of its factor [N], [N m]
    std::span<Factor> factors;
    std::span<const double> numbers;  ///< of all factors
    CATENARY_RECORD(places, begins, terms, forces, factors, numbers)
    CATENARY_SHAPES("n, n+1, e, e")
};

/// A load made ahead in slices, linear in time between them. Its places are the ones from `first`
/// to before `last`; its times begin at `times` and its samples, slice by slice, at `samples`;
/// `held` is the number of its slices.
struct SampledLoad {
    int64_t first, last, times, samples, held;
};

/// Such loads, side by side.
struct Sampled {
    std::span<const SampledLoad> loads;
    std::span<const double> times;  ///< [s]
    std::span<const int64_t> places;
    std::span<const double> samples;  ///< [N], [N m]
    CATENARY_RECORD(loads, times, places, samples)
};

/// All loads of a rank: `values` are their sum at the time clock[0] [s].
struct Loads {
    std::span<double> clock, values;
    std::span<const double> constant;  ///< constant part, shape of `values`
    Changing changing;
    Sampled sampled;
    Memories memories;
    CATENARY_RECORD(clock, values, constant, changing, sampled, memories)
    CATENARY_SHAPES("1, n, n")
};

/// Fill in `values` at the time of the clock.
void evaluate(const Loads& loads);

/// Fill `out` (m, k) with values at m points between two posts of k first-order Gauss-Markov
/// processes, which are `first` and `last` at the posts and decay as exp(-rate d), rates in 1/m.
/// `steps` (m + 1,) are from the first post to the point after it, and so on to the last post [m];
/// `normals` (m, k) standard normal numbers.
void bridge(std::span<const double> first, std::span<const double> last,
            std::span<const double> rates, std::span<const double> steps,
            Array2<const double> normals, Array2<double> out);

/// Add waves (s, k) times amplitudes (k, m) to `out` (s, m), in one order for any s and m.
void add_waves(Array2<const double> waves, Array2<const double> amplitudes, Array2<double> out);

}  // namespace catenary
