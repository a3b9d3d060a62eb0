#pragma once
// Solution of the small problem of a step: small dense systems with an active set of rows and
// columns, and room to work in, so that a step allocates nothing. Where the active set cycles there
// are pivoting, and dependents that carry in part.
//
// Contacts and links alone are a linear complementarity problem with a P-matrix, which pivoting
// solves. Bends of one link, and a wheel that slips one way or the other, have a row each; some of
// these act only where others do, and some only where others do not. Only sets that belong to a
// place along the link are taken: with others the matrix is no P-matrix. So a link goes from piece
// to piece of its law, one at a time, and with a law that rises all over it does not come back to
// one: with all rows before its own solved for, its residual has one sign to either side of where
// it stays.
//
// With dependents the matrix is no P-matrix either: the effect of a dropper across it is whole
// while it is taut and none while it is slack, whatever its tension, so it jumps where that passes
// zero. If the jump tightens the dropper that slackens, it is neither taut nor slack. The step then
// ends with its tension at zero and dependents that carry in part (docs/theory/lateral.md).
//
// Such parts are zeros of continuous maps without derivatives: Merrill's path of simplices.
//
// O. H. Merrill, Applications and extensions of an algorithm that computes fixed points of certain
// upper semi-continuous point to set mappings, dissertation, University of Michigan (1972); E. L.
// Allgower and K. Georg, Numerical continuation methods, Springer (1990), chapters 12 and 13.
//
// The space and a level between 0 and 1 are cut into simplices (Freudenthal's triangulation), all
// with their corners on the two levels. On level 0 stands z - start, on level 1 the map, between
// them the function that is linear in each simplex. Its zeros are a path that starts at the one on
// level 0. It cannot come back there, so it arrives at level 1 where the map points away from a
// point on a large sphere around it. Finer grids from there on, each with a path of its own, leave
// a zero as exact as wanted.
#include <functional>
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

/// A continuous map of R^n to itself: fills in the value at z; none of it need be a number.
using Map = std::function<void(std::span<const double> z, std::span<double> value)>;

/// Find a zero of a map that is known to less than `small`, and for which (z - start) . of(z) > 0
/// for all z that are far from the start.
///
/// `z` holds where to begin, and then the last place evaluated; the better, the shorter the path.
/// `width` is that of the first grid, in units of z; a largest component of `small` counts as zero.
/// Returns whether the place is a zero: not if the path is too long, or the map no number on it.
/// `room` is for 2 n unknowns at least.
bool find_zero(const Map& of, std::span<double> z, double width, double small, const Room& room);

/// Outcome of the solution for forces.
struct Found {
    int64_t rounds;  ///< that were needed; not positive if there is no solution
    bool pivoted;    ///< whether the active set cycled
    CATENARY_RECORD(rounds, pivoted)
};

/// Solve for signs by the active set, and where that does not settle within some rounds by Murty's
/// least-index pivoting: slower, but it cannot cycle for a P-matrix. Dependents go with their
/// leaders, in part if there is no other solution.
Found find_solution(const System& system, const Signs& signs, int64_t max_rounds, const Room& room);

}  // namespace catenary
