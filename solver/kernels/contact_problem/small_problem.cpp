// Tangents of Hertz's law with hysteresis, reported forces, the matrix of the small problem from
// influence coefficients, depths under its solution, and forces of a step by tangents of the law.
#include "contact_problem/small_problem.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace catenary {

void linearise(const MarchedHertzLaw& marched, std::span<const double> depth,
               std::span<const double> rate) {
    const auto& [law, speed, tangents, force] = marched;
    for (size_t i = 0; i < depth.size(); ++i) {
        double &offset = tangents.offset[i], &by_depth = tangents.by_depth[i],
               &by_rate = tangents.by_rate[i];
        const double d = depth[i];
        if (d <= 0.0) {
            offset = by_depth = by_rate = force[i] = 0.0;
            continue;
        }
        const double spring = law.stiffness * std::pow(d, law.exponent);
        const double loss = 1.0 + law.hysteresis * rate[i] / speed[i];
        force[i] = spring * loss;
        // Beyond the speed at which the law would pull it has no spring either.
        by_depth = law.exponent * spring / d * loss;
        if (by_depth < 0.0) by_depth = 0.0;
        by_rate = spring * law.hysteresis / speed[i];
        offset = force[i] - by_depth * d - by_rate * rate[i];
    }
}

void remember(const MarchedHertzLaw& marched, std::span<const double> depth,
              std::span<const double> rate) {
    for (size_t i = 0; i < depth.size(); ++i)
        if (depth[i] <= 0.0) marched.speed[i] = std::max(rate[i], marched.law.least_speed);
}

namespace {

/// Whether the contact law holds for forces (n,) at `time` [s]; if so they are remembered. A law
/// with gamma > 0 reports their mean over the step.
bool report(double time, std::span<const double> force, const ReportedForces& law) {
    if (law.gamma == 0.0) {
        std::ranges::copy(force, law.reported.begin());
        return true;
    }
    auto mean = [&](size_t i) { return law.gamma * force[i] + (1.0 - law.gamma) * law.latest[i]; };
    if (time > law.from_time)
        for (size_t i = 0; i < force.size(); ++i)
            if (mean(i) < 0.0) return false;
    for (size_t i = 0; i < force.size(); ++i) {
        law.reported[i] = mean(i);
        law.latest[i] = force[i];
    }
    return true;
}

/// Whether contact forces (n,) alone take any of the first `count` links beyond its reserve.
bool any_switched(const LinkRows& rows, int64_t count, const Coupled& coupled,
                  std::span<const double> force) {
    if (count > rows.capacity()) throw std::out_of_range("there are fewer rows of links");
    for (int64_t d = 0; d < count; ++d) part(coupled.released, rows.number(d), rows.number(d) + 1);
    for (int64_t d = 0; d < count; ++d) {
        if (coupled.behind[rows.number(d)] > 0) continue;
        double value = rows.reserve(d);
        for (int64_t i = 0; i < size(force); ++i) value += rows.reaction(d, i) * force[i];
        if (value < 0.0) return true;
    }
    return false;
}

}  // namespace

void couple(const LinkRows& rows, int64_t count, const Coupled& coupled,
            std::span<const double> by_depth, std::span<const double> by_rate, const Room& room) {
    const auto& band = coupled.band;
    const auto& matrix = room.matrix;
    const int64_t n = size(by_depth), half = band.columns / 2;
    for (int64_t d = 0; d < count; ++d) {
        const int64_t row = n + d, number = rows.number(d);
        const double released = coupled.released[number];
        room.behind[row] = coupled.behind[number];
        room.right[row] = -released * rows.reserve(d);
        for (int64_t i = 0; i < n; ++i) {
            matrix(row, i) = released * rows.reaction(d, i);
            matrix(i, row) = -(by_depth[i] * rows.lift(d, i) + by_rate[i] * rows.rise(d, i));
        }
        for (int64_t e = 0; e < count; ++e) {
            const int64_t other = rows.number(e), offset = number - other + half;
            const bool near = 0 <= offset && offset < band.columns;
            matrix(row, n + e) = near ? -released * band(other, offset) : 0.0;
        }
        matrix(row, row) += 1.0;
    }
}

void press(const Affine& gap, const Tangents& tangents, const Room& room) {
    const auto& [own, offset, by_depth, by_rate] = tangents;
    const auto& [depth, rate, by_force, rate_by_force] = gap;
    for (int64_t i = 0; i < size(depth); ++i) {
        room.right[i] = offset[i] + by_depth[i] * depth[i] + by_rate[i] * rate[i];
        for (int64_t j = 0; j < size(depth); ++j)
            room.matrix(i, j) = by_depth[i] * by_force(i, j) + by_rate[i] * rate_by_force(i, j);
        room.matrix(i, i) += own[i];
    }
}

bool subtract(const Affine& heads, const Affine& line, std::span<const double> present,
              const Affine& gap) {
    double total = 0.0;
    for (int64_t i = 0; i < size(gap.place); ++i) {
        const bool there = present[i] != 0.0;
        gap.place[i] = there ? heads.place[i] - line.place[i] : kNowhere;
        gap.rate[i] = there ? heads.rate[i] - line.rate[i] : 0.0;
        total += gap.place[i] + gap.rate[i];
        for (int64_t j = 0; j < size(gap.place); ++j) {
            gap.by_force(i, j) = present[i] * (heads.by_force(i, j) + line.by_force(i, j));
            gap.rate_by_force(i, j) =
                present[i] * (heads.rate_by_force(i, j) + line.rate_by_force(i, j));
            total += gap.by_force(i, j) + gap.rate_by_force(i, j);
        }
    }
    return std::isfinite(total);
}

Found slack_under(const LinkRows& rows, int64_t count, const Coupled& coupled,
                  std::span<const double> force, int64_t max_rounds, const Room& room) {
    std::ranges::fill(part(room.solution, 0, count), 0.0);
    if (!any_switched(rows, count, coupled, force)) return {1, false};
    couple(rows, count, coupled, {}, {}, room);
    for (int64_t d = 0; d < count; ++d) {
        room.always[d] = false;
        for (int64_t i = 0; i < size(force); ++i)
            room.right[d] -= coupled.released[rows.number(d)] * rows.reaction(d, i) * force[i];
    }
    return find_solution(room.system(count), room.signs(count), max_rounds, room);
}

bool under(const Affine& gap, const LinkRows& rows, std::span<const double> force,
           std::span<const double> compensation, const Depths& found) {
    double total = 0.0;
    for (int64_t i = 0; i < size(force); ++i) {
        double depth = gap.place[i], rate = gap.rate[i];
        for (int64_t j = 0; j < size(force); ++j) {
            depth -= gap.by_force(i, j) * force[j];
            rate -= gap.rate_by_force(i, j) * force[j];
        }
        for (int64_t k = 0; k < size(compensation); ++k) {
            depth += rows.lift(k, i) * compensation[k];
            rate += rows.rise(k, i) * compensation[k];
        }
        found.depth[i] = depth;
        found.rate[i] = rate;
        total += depth + rate;
    }
    return std::isfinite(total);
}

bool leaves_out(std::span<const double> force, std::span<const double> compensation,
                const LinkRows& rows, const Bounds& bounds, const Coupled& coupled) {
    const auto& [band, released, slackens, behind, drop] = coupled;
    const int64_t half = band.columns / 2, n = size(drop), m = size(compensation);
    if (n == 0) return false;
    for (size_t i = 0; i < force.size(); ++i)
        if (force[i] > bounds.push[i] || -force[i] > bounds.pull[i]) return true;
    for (int64_t k = 0; k < m; ++k) {
        if (compensation[k] == 0.0) continue;
        const int64_t e = rows.number(k), end = std::min(n, e + half + 1);
        for (int64_t d = std::max<int64_t>(0, e - half); d < end; ++d)
            if (released[d] > 0.0 && behind[d] == 0)
                drop[d] += compensation[k] * band(e, d - e + half);
    }
    for (int64_t k = 0; k < m; ++k) drop[rows.number(k)] = 0.0;
    double largest = 0.0;
    for (int64_t k = 0; k < m; ++k) {
        if (compensation[k] == 0.0) continue;
        const int64_t e = rows.number(k), end = std::min(n, e + half + 1);
        for (int64_t d = std::max<int64_t>(0, e - half); d < end; ++d) {
            largest = std::max(largest, drop[d]);
            drop[d] = 0.0;
        }
    }
    return largest > bounds.loss[0];
}

namespace {

/// Largest difference between the law and its last tangent, relative to the force.
constexpr double kTolerance = 1e-10;
/// How well depths [m] and rates [m/s] are known: differences of heights of 5 m and of speeds of
/// some m/s, a few roundings of 4e-16 to 9e-16 each. No force is known better than that times the
/// slope.
constexpr double kKnown = 5e-15;
/// Where so many tangents do not do, the tolerance takes in round-off: large terms may cancel in
/// depths and rates, and each term is known to some roundings of itself.
constexpr int64_t kUsualTangents = 12;
constexpr double kRounding = 8.0 * std::numeric_limits<double>::epsilon();

/// Whether contact forces and compensations that were found with tangents agree with the law, which
/// was linearised under them since; `number` tangents did not do before.
bool agrees(const Affine& gap, const LinkRows& rows, std::span<const double> force,
            std::span<const double> compensation, const MarchedHertzLaw& law, int64_t number) {
    const int64_t n = size(force);
    for (int64_t i = 0; i < n; ++i) {
        double depth = 0.0, rate = 0.0;
        if (number >= kUsualTangents) {
            depth = std::abs(gap.place[i]);
            rate = std::abs(gap.rate[i]);
            for (int64_t j = 0; j < n; ++j) {
                depth += std::abs(gap.by_force(i, j) * force[j]);
                rate += std::abs(gap.rate_by_force(i, j) * force[j]);
            }
            for (int64_t k = 0; k < size(compensation); ++k) {
                depth += std::abs(rows.lift(k, i) * compensation[k]);
                rate += std::abs(rows.rise(k, i) * compensation[k]);
            }
        }
        const double wanted = std::max(law.there[i], 0.0);
        const double within = kTolerance * (1.0 + wanted) +
                              (kKnown + kRounding * depth) * law.tangents.by_depth[i] +
                              (kKnown + kRounding * rate) * law.tangents.by_rate[i];
        if (!(std::abs(wanted - force[i]) <= within)) return false;
    }
    return true;
}

/// Find contact forces and compensations for a law's tangents, in the gap without forces.
Solved solve_tangents(const SmallProblem& problem) {
    const auto& [heads, share, gap, pulls, tangents, coupled, own_room, found, max_rounds] =
        problem;
    const auto& rows = share.rows;
    const int64_t n = size(gap.place), count = static_cast<int64_t>(share.flags[0].rows);
    const Room& room = *own_room;
    for (int64_t i = 0; i < n; ++i) {
        room.always[i] = pulls && share.present[i] != 0.0;
        room.behind[i] = 0;
    }
    press(gap, tangents, room);
    const auto force = room.solution.first(n);
    auto find_first = [&](int64_t of) {
        return find_solution(room.system(of), room.signs(of), max_rounds, room);
    };
    Found forces = find_first(n);
    int64_t used = n;
    if (forces.rounds > 0 && any_switched(rows, count, coupled, force)) {
        couple(rows, count, coupled, tangents.by_depth, tangents.by_rate, room);
        used = n + count;
        const Found all = find_first(used);
        forces = {all.rounds, all.pivoted || forces.pivoted};
    }
    const auto compensation = part(room.solution, n, used);
    const bool finite = under(gap, rows, force, compensation, found);
    const bool complete = !leaves_out(force, compensation, rows, share.bounds, coupled);
    return {forces.rounds, used, finite, complete, forces.pivoted};
}

}  // namespace

Solved solve(const SmallProblem& problem, const std::optional<MarchedHertzLaw>& law) {
    const auto& [heads, share, gap, pulls, tangents, coupled, room, found, max_rounds] = problem;
    const int64_t n = size(gap.place), count = static_cast<int64_t>(share.flags[0].rows);
    if (!room || n + count > room->k || count > share.rows.capacity()) return {};
    if (!subtract(heads, share.line, share.present, gap)) return {};
    // Without a force heads stand highest: from there Newton's method comes from one side.
    if (law) linearise(*law, gap.place, gap.rate);
    int64_t rounds = 0;
    bool pivoted = false;
    for (int64_t number = 0; number < kMostTangents; ++number) {
        const Solved solved = solve_tangents(problem);
        if (!law || solved.rounds <= 0 || !solved.finite) return solved;
        rounds += solved.rounds;
        pivoted = pivoted || solved.pivoted;
        linearise(*law, found.depth, found.rate);
        const auto compensation = part(room->solution, n, solved.size);
        if (agrees(gap, share.rows, room->solution.first(n), compensation, *law, number))
            return {rounds, solved.size, true, solved.complete, pivoted};
    }
    return {0, 0, true, false, false};
}

int64_t find_forces(double time, const SmallProblem& problem, const StepLaw& law,
                    std::span<int64_t> switched, Counts& counts) {
    const Flags& flags = problem.share.flags[0];
    const auto solution = problem.room->solution;
    const int64_t n = size(problem.gap.place);
    if (flags.broken != 0.0 || flags.missing != 0.0) return kLeft;
    const Solved solved = solve(problem, law.marched);
    if (solved.rounds <= 0 || !solved.finite) return kLeft;
    if (!solved.complete) return kTooSmall;
    if (!report(time, solution.first(n), law.reported)) return kLeft;
    if (law.marched) remember(*law.marched, problem.found.depth, problem.found.rate);
    counts.rounds += solved.rounds;
    counts.pivoted += solved.pivoted;
    for (int64_t k = 0; k < solved.size - n; ++k) {
        switched[k] = problem.share.rows.number(k);
        counts.slack += solution[n + k] != 0.0 && problem.coupled.slackens[switched[k]];
    }
    return solved.size - n;
}

void widen(const Bounds& bounds) {
    for (auto limits : {bounds.push, bounds.pull, bounds.loss})
        for (double& limit : limits) limit *= 2.0;
}

}  // namespace catenary
