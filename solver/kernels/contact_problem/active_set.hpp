#pragma once
// Small dense systems with an active set of rows and columns.
#include "contact_problem/room.hpp"

namespace catenary {

/// matrix x = right of m unknowns, the length of `right`; the matrix may have more of both.
struct System {
    Array2<double> matrix;
    std::span<double> right, solution;
    CATENARY_RECORD(right, solution, matrix)
    CATENARY_SHAPES("m, m, m.. m..")
};

/// Signs of m unknowns: `always` whether one may have any sign; `behind` of a dependent's row how
/// many rows before it its leader's is, with which it acts, 0 of others.
struct Signs {
    std::span<bool> always;
    std::span<int64_t> behind;
    CATENARY_RECORD(always, behind)
    CATENARY_SHAPES("m, m")
};

/// Solve the rows and columns that act by elimination with pivoting; the others are zero.
///
/// Rows may differ by orders of magnitude, as the rows of contacts with a law of impact and of
/// droppers do: elimination leaves the round-off of the largest in all. One refinement makes the
/// residual small beside the terms of each row (R. D. Skeel, Math. Comp. 35 (1980) 817-832).
void solve_on(const System& system, std::span<const bool> acts, const Room& room);

/// Primal-dual active-set iteration (semismooth Newton) for x = max(0, x - (matrix x - right)),
/// freely for `always`, and freely with its leader for a row `behind` one. Returns the rounds
/// needed, which are not positive if the set did not settle, or came back to one that it has had.
int64_t settle(const System& system, const Signs& signs, int64_t max_rounds, const Room& room);

}  // namespace catenary
