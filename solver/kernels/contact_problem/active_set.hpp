#pragma once
// Small dense systems with an active set of rows and columns, and room to work in for the small
// problem of a step, which allocates nothing.
#include "base/arrays.hpp"

namespace catenary {

/// Room for a path of simplices in up to n dimensions.
struct PathRoom {
    Array2<double> columns;  ///< (n + 1, n + 1)
    Array2<double> numbers;  ///< (7, n + 1)
    Array2<int64_t> counts;  ///< (4, n + 1)
    std::span<bool> all;     ///< (n + 1,)
    CATENARY_RECORD(columns, numbers, counts, all)
    CATENARY_SHAPES("n n, 7 n, 4 n, n")
};

/// Room to pivot with up to k unknowns.
struct PivotRoom {
    Array2<bool> needs, excludes;  ///< (k, k)
    std::span<int64_t> turned;     ///< (20 k + 100,)
    Array2<double> partly;         ///< (k, k)
    Array2<double> numbers;        ///< (4, k)
    Array2<int64_t> counts;        ///< (2, k)
    Array2<bool> marks;            ///< (3, k)
    PathRoom path;                 ///< of k / 2 dimensions
    CATENARY_RECORD(needs, excludes, turned, partly, numbers, counts, marks, path)
    CATENARY_SHAPES("k k, k k, 20k+100, k k, 4 k, 2 k, 3 k")
};

/// Room to solve for up to k unknowns: `factors` (k, k), the others (k,).
struct Room {
    Array2<double> factors;
    std::span<int64_t> acting, order;
    std::span<double> left, change;
    std::span<bool> acts, before;
    PivotRoom pivoting;
    CATENARY_RECORD(factors, acting, order, left, change, acts, before, pivoting)
    CATENARY_SHAPES("k k, k, k, k, k, k, k, k=k")
};

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
