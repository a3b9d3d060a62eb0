#pragma once
// Forces of a step on one rank, as far as kernels find them.
#include <optional>

#include "contact_problem/small_problem.hpp"

namespace catenary {

/// Counts of the work of steps, as in `schemes.Counters`.
struct Counts {
    int64_t steps;     ///< that were taken
    int64_t rounds;    ///< of the active-set iteration
    int64_t slack;     ///< links that slacken, step by step
    int64_t repeated;  ///< steps for which bounds were too small
    int64_t pivoted;   ///< steps in which an active set cycled
};

/// In place of a number of compensations: forces are left to others; bounds were too small.
inline constexpr int64_t kLeft = -1, kTooSmall = -2;

/// Tangents of a step at most: Newton's method on a law doubles its digits with each.
inline constexpr int64_t kMostTangents = 50;

/// The contact law and its reported forces.
struct StepLaw {
    std::optional<MarchedHertzLaw> marched;  ///< the law, unless it is linear
    ReportedForces reported;
    CATENARY_RECORD(marched, reported)
    CATENARY_SHAPES("n=n, n=n")
};

/// Find contact forces and compensations for a law: at once if it is linear, which is none here, or
/// else by Newton's method; no rounds, but finite, if that takes more than `kMostTangents`.
Solved solve(const SmallProblem& problem, const std::optional<MarchedHertzLaw>& law);

/// Find contact forces and compensations of the step to `time` [s], into the solution of the
/// problem; `switched` takes the numbers of the links with a compensation.
///
/// Returns the number of these, `kTooSmall` or `kLeft`.
int64_t find_forces(double time, const SmallProblem& problem, const StepLaw& law,
                    std::span<int64_t> switched, Counts& counts);

/// Double the bounds within which links that may switch have rows.
void widen(const Bounds& bounds);

}  // namespace catenary
