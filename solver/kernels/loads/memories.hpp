#pragma once
// Sums over the past of a line's ends. See end_memory.py.
#include "base/arrays.hpp"
#include "base/complex.hpp"

namespace catenary {

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

}  // namespace catenary
