#pragma once
// The motion of a rank's part of a line, as it is read at single unknowns; links whose force is
// followed, droppers and others that act one way, see switching_links.py; and outputs after a step.
#include <algorithm>
#include <vector>

#include "base/arrays.hpp"

namespace catenary {

/// Displacement d = s0 x + s1 y + s2 z and velocity v = s3 y + s4 z at the end of the latest step,
/// with x, y and z (n_local,) that a step carries on, and five shares. Numbers of an unknown are
/// `spacing` behind the numbers of the one before: more than one where scenes stand in lanes.
struct Motion {
    std::span<double> x, y, z;
    std::span<const double> shares;
    int64_t spacing = 1;
    CATENARY_RECORD(x, y, z, shares, spacing)
    CATENARY_SHAPES("n, n, n, 5")
};

inline double displacement_at(int64_t unknown, const Motion& motion) {
    const auto& s = motion.shares;
    const int64_t at = unknown * motion.spacing;
    return s[0] * motion.x[at] + s[1] * motion.y[at] + s[2] * motion.z[at];
}
inline double velocity_at(int64_t unknown, const Motion& motion) {
    const int64_t at = unknown * motion.spacing;
    return motion.shares[3] * motion.y[at] + motion.shares[4] * motion.z[at];
}

/// Fill in the largest |x| of each motion side by side, and then the largest |y|, at the unknowns
/// from `begin` to `end`.
void find_peak(const Motion& motion, int64_t begin, int64_t end, std::span<double> peak);
/// Whether one of these unknowns moves by more than a share of such a `peak`, or holds NaN.
bool moves(const Motion& motion, int64_t begin, int64_t end, std::span<const double> peak,
           double share);

/// Factors of a step of Newmark's or the generalized-alpha method. With b the acceleration that
/// balances the forces at the end of a step, the algorithm's is a = p + r b, where p is known when
/// the step begins: none by Newmark's method.
struct StepFactors {
    double dt, ratio;                           ///< [s], r
    double known_of_balanced, known_of_own;     ///< shares of b and a before in p
    double position_of_own, position_of_known;  ///< of a before and p in the displacement [s2]
    double velocity_of_own, velocity_of_known;  ///< and in the velocity [s]
    double work_velocity;  ///< c, so that K (d + c v) has the forces of damping on K, too
    double position_factor, velocity_factor;  ///< of b in displacement [s2] and velocity [s]
    double damping_share;  ///< of damping on mass that the acceleration lacks [1/s]
    CATENARY_RECORD(dt, ratio, known_of_balanced, known_of_own, position_of_own, position_of_known,
                    velocity_of_own, velocity_of_known, work_velocity, position_factor,
                    velocity_factor, damping_share)
};
/// Predictions in place (eq. 2.5) from b and p of the step before. `known` becomes the p of this
/// step, if it is not empty, and `work` -(d + c v).
void predict(std::span<double> displacement, std::span<double> velocity,
             std::span<const double> balanced, std::span<double> known, std::span<double> work,
             const StepFactors& factors);
/// New displacement and velocity from predictions and acceleration (eq. 2.6). The acceleration
/// still lacks -`damping_share` v, the part of damping on mass.
void correct(std::span<double> displacement, std::span<double> velocity,
             std::span<double> acceleration, double position_factor, double velocity_factor,
             double damping_share);

/// Fill in displacements, velocities, of the unknowns from `begin` on.
void displacements(const Motion& motion, int64_t begin, std::span<double> result);
void velocities(const Motion& motion, int64_t begin, std::span<double> result);

/// Law of a link with stretch e. Its reserve R = rest + stiffness e + damping e' [N] is left until
/// it switches; its force is `carried` R, plus the compensation -`released` R where R < 0.
struct Reserve {
    double rest, stiffness, damping;  ///< [N], [N/m], [N s/m], as long as it is as at rest
    double place;                     ///< along the track [m]
    double released;                  ///< share of -R > 0 that is the compensation
    double carried;                   ///< share of R that is force
};

/// n links: unknowns and weights of their direction, (n, m) each.
struct Links {
    Array2<const int64_t> unknowns;
    Array2<const double> weights;
    std::span<const Reserve> law;
    CATENARY_RECORD(unknowns, weights, law)
    CATENARY_SHAPES("n m, n m, n")
};

/// Dependents of links: of link d the `links` from begin[d] to before begin[d + 1].
struct Dependents {
    Links links;
    std::span<const int64_t> begin;
    CATENARY_RECORD(links, begin)
    CATENARY_SHAPES("*, n+1?")
};

/// Stretch of a link in displacements, or in an answer, of all unknowns.
inline double stretch_of(int64_t link, const Links& links, std::span<const double> numbers) {
    const auto unknowns = links.unknowns[link];
    const auto weights = links.weights[link];
    double total = 0.0;
    for (size_t k = 0; k < unknowns.size(); ++k) total += weights[k] * numbers[unknowns[k]];
    return total;
}

/// Reserve of a link [N].
inline double reserve_of(int64_t link, const Links& links, const Motion& motion) {
    const auto unknowns = links.unknowns[link];
    const auto weights = links.weights[link];
    double x = 0.0, y = 0.0, z = 0.0;
    for (size_t k = 0; k < unknowns.size(); ++k) {
        const int64_t at = unknowns[k] * motion.spacing;
        x += weights[k] * motion.x[at];
        y += weights[k] * motion.y[at];
        z += weights[k] * motion.z[at];
    }
    const Reserve& law = links.law[link];
    const auto& s = motion.shares;
    const double stretch = s[0] * x + s[1] * y + s[2] * z, speed = s[3] * y + s[4] * z;
    return law.rest + law.stiffness * stretch + law.damping * speed;
}

/// Fill in the reserves of links from `begin` to `end`.
void reserves_within(const Motion& motion, const Links& links, int64_t begin, int64_t end,
                     std::span<double> result);
/// Fill in all reserves.
void reserves(const Motion& motion, const Links& links, std::span<double> result);
/// Elastic energy that links from `begin` to `end` and their dependents add to that of K where they
/// have switched [J]: negative of slack droppers, positive of closed stops, none of dampers.
double energy_of_switching(std::span<const double> displacement, const Links& links,
                           const Dependents& dependents, int64_t begin, int64_t end);

/// Columns of several tables by the stations that they follow from; see moving_columns.py.
struct Columns {
    std::span<const int64_t> ends;    ///< first station that moves and the one after the last
    std::span<const int64_t> starts;  ///< (n + 1,) first unknown of each station
    /// Of each of k tables (n + 1, k) the first column that follows from a station or from one
    /// behind it, and the column after the last one that follows from stations before it.
    Array2<const int32_t> first, last;
    CATENARY_RECORD(ends, starts, first, last)
    CATENARY_SHAPES("2.., n+1, n+1 3, n+1 3")
};

/// Columns of the tables, as ``Shown`` has them.
enum ShownTable { kArms, kDroppers, kOthers };

struct Shown {
    Motion motion;
    std::span<const int64_t> arms;  ///< unknowns of vertical displacement at steady arms
    Links droppers, others;         ///< droppers, and all other links
    Dependents dropper_bends, other_bends;
    std::span<double> other_force;  ///< room for the forces of the latter [N]
    Columns columns;                ///< of arms, droppers and others
    CATENARY_RECORD(motion, arms, droppers, others, dropper_bends, other_bends, other_force,
                    columns)
    CATENARY_SHAPES("*, a, n=d, *, n=d, *, *, *")
};

/// Displacement at arms [m] and forces of droppers and of other links [N], as far as they follow
/// from stations from `begin` to `end`.
void show(const Shown& shown, std::span<double> uplift, std::span<double> dropper_force,
          int64_t begin, int64_t end);

/// Extend a range of `stations`, first and last + 1, by another one.
inline void take_in(std::span<int64_t> stations, std::span<const int64_t> moving) {
    stations[0] = std::min(stations[0], moving[0]);
    stations[1] = std::max(stations[1], moving[1]);
}

/// Motions kept of steps from which a march may be resumed; see KeptMotions.
struct KeptMotions {
    std::span<const int64_t> motion_of;  ///< number of the motion that keeps a step, -1 if none
    std::span<double> numbers;  ///< room for displacements and velocities, a motion after another
    Array2<int64_t> stations;   ///< of each motion the first, the last + 1, where its numbers begin
    std::span<int64_t> used;    ///< (1,) how much of the room is
    std::span<int64_t> moved;   ///< stations that have moved since the motion before
    std::vector<std::span<const double>> places;  ///< numbers that are kept with a motion
    Array2<double> kept_places;                   ///< (n_motions, n) room for these
    CATENARY_RECORD(motion_of, numbers, stations, used, moved, places, kept_places)
    CATENARY_SHAPES("n, *, m 3, 1?, 2?, *, m *")
};

/// Keep the motion of a step as that of a number; whether there is room for it.
bool keep(const KeptMotions& kept, int64_t number, const Motion& motion, const Columns& columns);

/// Copy arrays one after another.
inline void copy_all(const std::vector<std::span<const double>>& arrays, std::span<double> result) {
    int64_t at = 0;
    for (const auto& array : arrays) {
        std::ranges::copy(array, part(result, at, at + size(array)).begin());
        at += size(array);
    }
}

}  // namespace catenary
