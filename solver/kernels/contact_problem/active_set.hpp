#pragma once
// Small dense systems with an active set of rows and columns, and room to work in for the small
// problem of a step, which allocates nothing in it.
#include <memory>
#include <vector>

#include "base/arrays.hpp"

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

/// Room for a path of simplices in up to n dimensions.
struct PathRoom {
    Array2<double> columns;  ///< (n + 1, n + 1)
    Array2<double> numbers;  ///< (7, n + 1)
    Array2<int64_t> counts;  ///< (4, n + 1)
    std::span<bool> all;     ///< (n + 1,)
};

/// Room for a problem of up to k unknowns, such as contact forces and then compensations.
class Room {
    std::vector<std::shared_ptr<void>> memory_;
    template <class T>
    std::span<T> numbers(int64_t n) {
        const std::shared_ptr<T[]> own(new T[n]());
        memory_.push_back(own);
        return {own.get(), static_cast<size_t>(n)};
    }
    template <class T>
    Array2<T> table(int64_t rows, int64_t columns) {
        return {numbers<T>(rows * columns).data(), rows, columns};
    }

  public:
    explicit Room(int64_t most) : k(most) {}

    int64_t k;
    /// The problem and its solution, see `System` and `Signs`.
    Array2<double> matrix = table<double>(k, k);
    std::span<double> right = numbers<double>(k), solution = numbers<double>(k);
    std::span<bool> always = numbers<bool>(k);
    std::span<int64_t> behind = numbers<int64_t>(k);
    /// The system of the first unknowns, and their signs.
    System system(int64_t n) const { return {matrix, right.first(n), solution.first(n)}; }
    Signs signs(int64_t n) const { return {always.first(n), behind.first(n)}; }
    /// For elimination, and sets of rows that act.
    Array2<double> factors = table<double>(k, k);
    std::span<int64_t> acting = numbers<int64_t>(k), order = numbers<int64_t>(k);
    std::span<double> left = numbers<double>(k), change = numbers<double>(k);
    std::span<bool> acts = numbers<bool>(k), before = numbers<bool>(k);
    /// For pivoting.
    Array2<bool> needs = table<bool>(k, k), excludes = table<bool>(k, k);
    std::span<int64_t> turned = numbers<int64_t>(20 * k + 100);
    std::span<bool> odd = numbers<bool>(k);
    /// For shares of dependents, of which there are no more than leaders.
    Array2<double> partly = table<double>(k, k), of_shares = table<double>(4, k);
    Array2<int64_t> numbers_of_leaders = table<int64_t>(2, k);
    Array2<bool> marks = table<bool>(2, k);
    PathRoom path{table<double>(k / 2 + 1, k / 2 + 1), table<double>(7, k / 2 + 1),
                  table<int64_t>(4, k / 2 + 1), numbers<bool>(k / 2 + 1)};
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
