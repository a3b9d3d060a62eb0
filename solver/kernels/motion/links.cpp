// Loops over links whose force is followed.
#include "motion/links.hpp"

#include <algorithm>

#include "base/targets.hpp"

namespace catenary {

namespace {

/// Reserves of links between two unknowns, as droppers alone are, mostly: without a loop over
/// unknowns this takes half the time.
CATENARY_FOR_TARGETS
void reserves_of_pairs(const Motion& motion, const Links& links, int64_t begin, int64_t end,
                       double* __restrict result) {
    const double *x = motion.x.data(), *y = motion.y.data(), *z = motion.z.data();
    const double s0 = motion.shares[0], s1 = motion.shares[1], s2 = motion.shares[2],
                 s3 = motion.shares[3], s4 = motion.shares[4];
    const int64_t spacing = motion.spacing;
    for (int64_t link = begin; link < end; ++link) {
        const int64_t i = links.unknowns(link, 0) * spacing, j = links.unknowns(link, 1) * spacing;
        const double u = links.weights(link, 0), v = links.weights(link, 1);
        const double of_x = u * x[i] + v * x[j], of_y = u * y[i] + v * y[j],
                     of_z = u * z[i] + v * z[j];
        const Reserve& law = links.law[link];
        result[link] = law.rest + law.stiffness * (s0 * of_x + s1 * of_y + s2 * of_z) +
                       law.damping * (s3 * of_y + s4 * of_z);
    }
}

}  // namespace

void reserves_within(const Motion& motion, const Links& links, int64_t begin, int64_t end,
                     std::span<double> result) {
    if (links.unknowns.columns == 2)
        return reserves_of_pairs(motion, links, begin, end, result.data());
    for (int64_t link = begin; link < end; ++link) result[link] = reserve_of(link, links, motion);
}

void reserves(const Motion& motion, const Links& links, std::span<double> result) {
    reserves_within(motion, links, 0, size(result), result);
}

void forces_within(const Motion& motion, const Links& links, int64_t begin, int64_t end,
                   std::span<double> result) {
    reserves_within(motion, links, begin, end, result);
    for (int64_t link = begin; link < end; ++link) {
        const Reserve& law = links.law[link];
        const double share = result[link] < 0.0 ? law.carried - law.released : law.carried;
        result[link] = share * result[link] + 0.0;  // no negative zero, as of a slack dropper
    }
}

void add_bends(const Motion& motion, const Dependents& bends, int64_t begin, int64_t end,
               std::span<double> result) {
    if (bends.links.law.empty()) return;
    for (int64_t link = begin; link < end; ++link)
        for (int64_t b = bends.begin[link]; b < bends.begin[link + 1]; ++b)
            result[link] -=
                bends.links.law[b].released * std::min(reserve_of(b, bends.links, motion), 0.0);
}

double energy_of_switching(std::span<const double> displacement, const Links& links,
                           const Dependents& dependents, int64_t begin, int64_t end) {
    double energy = 0.0;
    part(links.law, begin, end);
    for (int64_t link = begin; link < end; ++link) {
        const Reserve& law = links.law[link];
        if (law.stiffness == 0.0) continue;  // dampers store no energy
        const double stretch = stretch_of(link, links, displacement);
        const double beyond = std::min(law.rest + law.stiffness * stretch, 0.0);
        energy -= law.released * beyond * beyond / (2.0 * law.stiffness);
        if (!(beyond < 0.0)) continue;
        for (int64_t r = dependents.begin[link]; r < dependents.begin[link + 1]; ++r) {
            const Reserve& own = dependents.links.law[r];
            const double across = stretch_of(r, dependents.links, displacement);
            energy -= 0.5 * own.released * own.stiffness * across * across;
        }
    }
    return energy;
}

}  // namespace catenary
