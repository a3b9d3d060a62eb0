#pragma once
// Links whose force is followed: droppers, and others that act one way. See switching_links.py.
#include "motion/state.hpp"

namespace catenary {

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
/// Fill in the forces of links from `begin` to `end` [N], positive where they pull.
void forces_within(const Motion& motion, const Links& links, int64_t begin, int64_t end,
                   std::span<double> result);
/// Add the forces of bends beyond their reserves to the forces [N] of links from `begin` to `end`;
/// `released` of a bend that pushes is below zero.
void add_bends(const Motion& motion, const Dependents& bends, int64_t begin, int64_t end,
               std::span<double> result);
/// Elastic energy that links from `begin` to `end` and their dependents add to that of K where they
/// have switched [J]: negative of slack droppers, positive of closed stops, none of dampers.
double energy_of_switching(std::span<const double> displacement, const Links& links,
                           const Dependents& dependents, int64_t begin, int64_t end);

}  // namespace catenary
