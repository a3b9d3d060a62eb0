#pragma once
// Loads in time on the unknowns that a rank solves for, see line_loads.py; amplitudes of
// gusts along a line, and the waves that they make, see wind.py; and ends of a line: dynamic
// condensation of the spans beyond them, Schur complements at frequencies (ends.py), and sums over
// their past, by Fourier transforms in place whose length is a power of two.
#include <complex>

#include "base/arrays.hpp"

namespace catenary {

using Complex = std::complex<double>;

inline Complex product(Complex one, Complex other) {
    return {one.real() * other.real() - one.imag() * other.imag(),
            one.real() * other.imag() + one.imag() * other.real()};
}
inline Complex product(Complex one, double other) {
    return {one.real() * other, one.imag() * other};
}

/// Fill `taken` (n, k, k) with beside^T inverse(bands) beside, with `weights` (n, 3) of M, C and K
/// in each; see `SpanMatrices`. L D L^T without pivots: with waves that fade, all leading blocks
/// are those of damped lines.
void condense_spans(Array2<const Complex> weights, Array3<const double> bands,
                    Array3<const double> beside, Array3<Complex> taken);

/// Transform numbers in place, into the order of reversed bits. `turns` hold exp(-i pi k / h)
/// at h + k for each power h below the length.
void fourier_forth(std::span<Complex> numbers, std::span<const Complex> turns);
/// Transform the result of `fourier_forth` back into the numbers, times their count.
void fourier_back(std::span<Complex> numbers, std::span<const Complex> turns);

/// Lags below this are summed one by one; a power of two.
constexpr int64_t kNear = 128;

/// An end with m unknowns that remembers n steps: where in the tables its own begins.
struct EndMemory {
    int64_t width, n_steps;
    int64_t levels;   ///< doubles of kNear, itself included, that are lags of n steps
    int64_t past;     ///< (m, n) its accelerations [m/s2]
    int64_t sums;     ///< (m, n) forces at each step by the steps up to `done` [N], [N m]
    int64_t near;     ///< (m, m, kNear) Q of lags from zero on
    int64_t spectra;  ///< (m / 2, m, 2 L) for each L, two rows of Q as one complex one
    int64_t done;     ///< the latest step that is remembered
    double dt;        ///< [s]
};

/// Memory of all ends of a rank.
struct MemoryTables {
    std::span<EndMemory> ends;
    std::span<double> past, sums;
    std::span<const double> near;
    std::span<const Complex> spectra;
    Array2<Complex> room;            ///< (most unknowns + 1, longest transform)
    std::span<const Complex> turns;  ///< of the longest transform, see `fourier_forth`
    CATENARY_RECORD(ends, past, sums, near, spectra, room, turns)
};

/// All ends' unknowns, and the accelerations that they remember of each: shares of two arrays.
struct Memories {
    std::span<const int64_t> into, own;     ///< among loads, and among accelerations
    std::span<const double> latest, known;  ///< [m/s2]
    std::span<const double> shares;         ///< (2,) of both
    MemoryTables tables;
    CATENARY_RECORD(into, own, latest, known, shares, tables)
    CATENARY_SHAPES("n, n, *, *, 2")
};

/// Add the forces of all ends at a time [s], minus `sums`, to `values`. The accelerations are the
/// ones of the step before; a step that is repeated remembers them once.
void remember(double time, std::span<double> values, const Memories& memories);
/// Make up for `n_steps` whose accelerations are in the past, and for none after these.
void recall(const MemoryTables& tables, int64_t n_steps);

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

/// Add waves (s, k) times amplitudes (k, m) to `out` (s, m), in one order for any s and m.
void add_waves(Array2<const double> waves, Array2<const double> amplitudes, Array2<double> out);

}  // namespace catenary
