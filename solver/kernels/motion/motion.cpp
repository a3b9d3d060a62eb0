// Loops over the motion of a rank's part of a line, links whose force is followed, and outputs.
#include "motion/motion.hpp"

#include <algorithm>
#include <cmath>

#include "base/targets.hpp"

namespace catenary {

void find_peak(const Motion& motion, int64_t begin, int64_t end, std::span<double> peak) {
    const int64_t n = motion.spacing;
    std::ranges::fill(peak, 0.0);
    for (int64_t i = begin * n; i < end * n; i += n)
        for (int64_t lane = 0; lane < n; ++lane) {
            peak[lane] = std::max(peak[lane], std::abs(motion.x[i + lane]));
            peak[n + lane] = std::max(peak[n + lane], std::abs(motion.y[i + lane]));
        }
}

bool moves(const Motion& motion, int64_t begin, int64_t end, std::span<const double> peak,
           double share) {
    const int64_t n = motion.spacing;
    for (int64_t i = begin * n; i < end * n; i += n)
        for (int64_t lane = 0; lane < n; ++lane)
            if (!(std::abs(motion.x[i + lane]) <= share * peak[lane] &&
                  std::abs(motion.y[i + lane]) <= share * peak[n + lane]))
                return true;
    return false;
}

CATENARY_FOR_TARGETS
void predict(std::span<double> displacement, std::span<double> velocity,
             std::span<const double> balanced, std::span<double> known, std::span<double> work,
             const StepFactors& factors) {
    const StepFactors s = factors;
    const bool has_known = !known.empty();
    for (size_t i = 0; i < displacement.size(); ++i) {
        double a = balanced[i], p = 0.0;
        if (has_known) {
            a = known[i] + s.ratio * balanced[i];
            known[i] = p = s.known_of_balanced * balanced[i] + s.known_of_own * a;
        }
        const double d =
            displacement[i] + s.dt * velocity[i] + s.position_of_own * a + s.position_of_known * p;
        const double v = velocity[i] + s.velocity_of_own * a + s.velocity_of_known * p;
        displacement[i] = d;
        velocity[i] = v;
        work[i] = -(d + s.work_velocity * v);
    }
}

CATENARY_FOR_TARGETS
void correct(std::span<double> displacement, std::span<double> velocity,
             std::span<double> acceleration, double position_factor, double velocity_factor,
             double damping_share) {
    // Long lines wait for memory: unchanged accelerations are not written.
    const bool writes = damping_share != 0.0;
    for (size_t i = 0; i < displacement.size(); ++i) {
        const double v = velocity[i], a = acceleration[i] - damping_share * v;
        if (writes) acceleration[i] = a;
        velocity[i] = v + velocity_factor * a;
        displacement[i] += position_factor * a;
    }
}

CATENARY_FOR_TARGETS
void displacements(const Motion& motion, int64_t begin, std::span<double> result) {
    const Motion m = motion;
    const double a = m.shares[0], b = m.shares[1], c = m.shares[2];
    const int64_t n = size(result);
    const auto x = part(m.x, begin, begin + n), y = part(m.y, begin, begin + n),
               z = part(m.z, begin, begin + n);
    for (int64_t i = 0; i < n; ++i) result[i] = a * x[i] + b * y[i] + c * z[i];
}

CATENARY_FOR_TARGETS
void velocities(const Motion& motion, int64_t begin, std::span<double> result) {
    const double b = motion.shares[3], c = motion.shares[4];
    const int64_t n = size(result);
    const auto y = part(motion.y, begin, begin + n), z = part(motion.z, begin, begin + n);
    for (int64_t i = 0; i < n; ++i) result[i] = b * y[i] + c * z[i];
}

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

namespace {

/// Fill in the forces of links from `begin` to `end` [N], positive where they pull, with those of
/// bends beyond their reserves; `released` of a bend that pushes is below zero.
void forces_within(const Motion& motion, const Links& links, const Dependents& bends, int64_t begin,
                   int64_t end, std::span<double> result) {
    reserves_within(motion, links, begin, end, result);
    for (int64_t link = begin; link < end; ++link) {
        const Reserve& law = links.law[link];
        const double share = result[link] < 0.0 ? law.carried - law.released : law.carried;
        result[link] = share * result[link] + 0.0;  // no negative zero, as of a slack dropper
        if (bends.links.law.empty()) continue;
        for (int64_t b = bends.begin[link]; b < bends.begin[link + 1]; ++b)
            result[link] -=
                bends.links.law[b].released * std::min(reserve_of(b, bends.links, motion), 0.0);
    }
}

}  // namespace

void show(const Shown& shown, std::span<double> uplift, std::span<double> dropper_force,
          int64_t begin, int64_t end) {
    for (const int64_t station : {begin, end}) part(shown.columns.starts, station, station + 1);
    const auto first = shown.columns.first[begin], last = shown.columns.last[end];
    for (int64_t i = first[kArms]; i < last[kArms]; ++i)
        uplift[i] = displacement_at(shown.arms[i], shown.motion);
    forces_within(shown.motion, shown.droppers, shown.dropper_bends, first[kDroppers],
                  last[kDroppers], dropper_force);
    if (shown.other_force.empty()) return;
    forces_within(shown.motion, shown.others, shown.other_bends, first[kOthers], last[kOthers],
                  shown.other_force);
}

bool keep(const KeptMotions& kept, int64_t number, const Motion& motion, const Columns& columns) {
    const int64_t begin = columns.starts[kept.moved[0]], end = columns.starts[kept.moved[1]];
    const int64_t n = end - begin, at = part(kept.used, 0, 1)[0];
    if (at + 2 * n > size(kept.numbers)) return false;
    displacements(motion, begin, kept.numbers.subspan(at, n));
    velocities(motion, begin, kept.numbers.subspan(at + n, n));
    const auto stations = kept.stations[number];
    stations[0] = kept.moved[0];
    stations[1] = kept.moved[1];
    stations[2] = at;
    kept.used[0] = at + 2 * n;
    kept.moved[0] = columns.ends[0];
    kept.moved[1] = columns.ends[1];
    copy_all(kept.places, kept.kept_places[number]);
    return true;
}

}  // namespace catenary
