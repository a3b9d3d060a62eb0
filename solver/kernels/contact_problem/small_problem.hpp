#pragma once
// The small dense problem of a step: contact forces and switching links, a linear complementarity
// problem of their influence matrix, with contact laws, their tangents and reported forces. For the
// equations see solver/contact_problem/coupling.py.
#include <optional>

#include "base/arrays.hpp"
#include "contact/response.hpp"
#include "contact_problem/pivoting.hpp"

namespace catenary {

/// own f = offset + by_depth d + by_rate d' at n contacts, with depth d and rate d' of the gap
/// under forces f; (n,) each [-], [N], [N/m], [N s/m].
struct Tangents {
    std::span<double> own, offset, by_depth, by_rate;
    CATENARY_RECORD(own, offset, by_depth, by_rate)
    CATENARY_SHAPES("n, n, n, n")
};

/// f = K d^n (1 + chi d' / d0') with the rate d0' at which the gap closed.
struct HertzLaw {
    double stiffness, exponent, hysteresis;  ///< K [N/m^n], n, chi
    double least_speed;                      ///< of the rates at which gaps close [m/s]
    CATENARY_RECORD(stiffness, exponent, hysteresis, least_speed)
};
/// The law at n contacts.
struct MarchedHertzLaw {
    HertzLaw law;
    std::span<double> speed;  ///< rates at which gaps closed [m/s], (n,)
    Tangents tangents;        ///< where the law was linearised last
    std::span<double> there;  ///< forces of the law there, not cut at zero [N], (n,)
    CATENARY_RECORD(law, speed, tangents, there)
    CATENARY_SHAPES("*, n, n=n, n")
};
/// Linearise the law at depths [m] and rates [m/s], (n,) each.
void linearise(const MarchedHertzLaw& marched, std::span<const double> depth,
               std::span<const double> rate);
/// Store at the end of a step the rates at which open gaps close.
void remember(const MarchedHertzLaw& marched, std::span<const double> depth,
              std::span<const double> rate);

/// Forces of n contacts as reported at the end of a step.
struct ReportedForces {
    double gamma;                ///< weight of the new force in the reported one; 0 reports itself
    double from_time;            ///< from which on a reported force that pulls ends the run [s]
    std::span<double> latest;    ///< forces of the latest step [N], (n,) if gamma is not 0
    std::span<double> reported;  ///< reported forces (n,) [N]
    CATENARY_RECORD(gamma, from_time, latest, reported)
    CATENARY_SHAPES("*, *, n?, n")
};

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
    Room* room;          ///< in which the solution is left
    Depths found;        ///< under the solution
    int64_t max_rounds;  ///< of the active-set iteration
    CATENARY_RECORD(heads, share, gap, pulls, tangents, coupled, room, found, max_rounds)
    CATENARY_SHAPES("n=n, n=n, n=n, *, n=n, *, *, n=n")
};

struct Solved {
    int64_t rounds;  ///< not positive if there is no solution
    int64_t size;    ///< unknowns used: n if no contact force takes a link beyond its reserve, else
                     ///< n + the number of rows
    bool finite;     ///< whether depths and rates are
    bool complete;   ///< whether all links that have switched had a row, see `leaves_out`
    bool pivoted;    ///< whether an active set cycled
    CATENARY_RECORD(rounds, size, finite, complete, pivoted)
};

/// Fill in the gap without forces, and its decrease by forces; whether all of it is finite.
bool subtract(const Affine& heads, const Affine& line, std::span<const double> present,
              const Affine& gap);
/// Put right-hand side and matrix of the contact forces when no link has switched.
void press(const Affine& gap, const Tangents& tangents, const Room& room);
/// Put the rows and columns of the first `count` links behind the ones of the n contacts, and how
/// many rows each is behind its leader. `by_depth` and `by_rate` (n,) are as in `Tangents`.
void couple(const LinkRows& rows, int64_t count, const Coupled& coupled,
            std::span<const double> by_depth, std::span<const double> by_rate, const Room& room);
/// Solve for the compensations of the first `count` links alone under contact forces (n,) [N].
Found slack_under(const LinkRows& rows, int64_t count, const Coupled& coupled,
                  std::span<const double> force, int64_t max_rounds, const Room& room);
/// Fill in depths and rates under forces (n,) and compensations (m,) [N]; whether all are finite.
bool under(const Affine& gap, const LinkRows& rows, std::span<const double> force,
           std::span<const double> compensation, const Depths& found);
/// Whether a link without a row may have switched, as the bounds were too small: a contact force is
/// beyond its limit, or compensations (m,) take more than the limit off the reserve of a link
/// elsewhere.
bool leaves_out(std::span<const double> force, std::span<const double> compensation,
                const LinkRows& rows, const Bounds& bounds, const Coupled& coupled);

/// Counts of the work of steps, as in `scheme.Counters`.
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
