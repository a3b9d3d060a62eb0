#pragma once
// The small dense problem of a step: contact forces and switching links, a linear complementarity
// problem of their influence matrix. For the equations see
// solver/contact_problem/complementarity.py.
#include "contact/response.hpp"
#include "contact_problem/pivoting.hpp"
#include "contact_problem/laws.hpp"

namespace catenary {

/// Depth where there is no wire on a strip [m]: out of contact, whatever the law.
inline constexpr double kNowhere = -1.0;

/// Coupling of all links of the line in the small problem, by their numbers.
struct Coupled {
    Array2<const double> band;         ///< (n_links, 2 half + 1): band(e, d - e + half) is the
                                       ///< decrease of d's reserve by a unit compensation of e [-]
    std::span<const double> released;  ///< share of -R > 0 that is the compensation, see `Reserve`
    std::span<const bool> slackens;    ///< whether it slackens, and is no stop that closes
    std::span<const int64_t> behind;   ///< of a dependent how many numbers its leader is before it
    std::span<double> drop;            ///< room to work, all zero before and after
    CATENARY_RECORD(band, released, slackens, behind, drop)
    CATENARY_SHAPES("n *, n, n, n, n")
};

/// Room for a problem with up to k unknowns: contact forces, then compensations.
struct Unknowns {
    static constexpr bool kScratch = true;  ///< no step reads numbers of the one before
    std::span<bool> always;                 ///< see `Signs`
    std::span<int64_t> behind;
    Array2<double> matrix;  ///< (k, k)
    std::span<double> right, solution;
    Room* room;

    /// The system of the first ones, and their signs.
    System system(int64_t n) const { return {matrix, right.first(n), solution.first(n)}; }
    Signs signs(int64_t n) const { return {always.first(n), behind.first(n)}; }
    CATENARY_RECORD(always, behind, matrix, right, solution, room)
    CATENARY_SHAPES("k, k, k k, k, k")
};

/// Depths [m] and rates [m/s] of the gap at n contacts under forces.
struct Depths {
    std::span<double> depth, rate;
    CATENARY_RECORD(depth, rate)
    CATENARY_SHAPES("n, n")
};

struct SmallProblem {
    Affine heads;
    Share share;        ///< of the line, summed over ranks
    Affine gap;         ///< room for depths between them
    bool pulls;         ///< whether forces of contacts on strips may have any sign
    Tangents tangents;  ///< of the contact law
    Coupled coupled;
    Unknowns unknowns;   ///< in which the solution is left
    Depths found;        ///< under the solution
    int64_t max_rounds;  ///< of the active-set iteration
    CATENARY_RECORD(heads, share, gap, pulls, tangents, coupled, unknowns, found, max_rounds)
    CATENARY_SHAPES("n=n, n=n, n=n, *, n=n, *, k=k, n=n")
};

struct Solved {
    int64_t rounds;  ///< not positive if there is no solution
    int64_t size;    ///< unknowns used: n if no contact force takes a link beyond its reserve, else
                     ///< n + the number of rows
    bool finite;     ///< whether depths and rates are
    bool complete;   ///< whether all links that have switched had a row, see `leaves_out`
    bool pivoted;    ///< whether an active set cycled
};

/// Find contact forces and compensations for a law's tangents.
Solved solve(const SmallProblem& problem);

/// Fill in the gap without forces, and its decrease by forces; whether all of it is finite.
bool subtract(const Affine& heads, const Affine& line, std::span<const double> present,
              const Affine& gap);
/// Put right-hand side and matrix of the contact forces when no link has switched.
void press(const Affine& gap, const Tangents& tangents, const Unknowns& unknowns);
/// Whether contact forces (n,) alone take any of the first `count` links beyond its reserve.
bool any_switched(const LinkRows& rows, int64_t count, const Coupled& coupled,
                  std::span<const double> force);
/// Put the rows and columns of the first `count` links behind the ones of the n contacts, and how
/// many rows each is behind its leader. `by_depth` and `by_rate` (n,) are as in `Tangents`.
void couple(const LinkRows& rows, int64_t count, const Coupled& coupled,
            std::span<const double> by_depth, std::span<const double> by_rate,
            const Unknowns& unknowns);
/// Fill in depths and rates under forces (n,) and compensations (m,) [N]; whether all are finite.
bool under(const Affine& gap, const LinkRows& rows, std::span<const double> force,
           std::span<const double> compensation, const Depths& found);
/// Whether a link without a row may have switched, as the bounds were too small: a contact force is
/// beyond its limit, or compensations (m,) take more than the limit off the reserve of a link
/// elsewhere.
bool leaves_out(std::span<const double> force, std::span<const double> compensation,
                const LinkRows& rows, const Bounds& bounds, const Coupled& coupled);

}  // namespace catenary
