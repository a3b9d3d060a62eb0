#pragma once
// Room to work in for the small problem of a step, which allocates nothing.
#include "base/arrays.hpp"
#include "base/record.hpp"

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

}  // namespace catenary
