// Contact forces and compensations of a step, by tangents of the contact law.
#include "contact_problem/forces.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace catenary {

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

}  // namespace

Solved solve(const SmallProblem& problem, const std::optional<MarchedHertzLaw>& marched) {
    if (!marched) return solve(problem);
    const MarchedHertzLaw& law = *marched;
    const auto& [depth, rate] = problem.found;
    const Affine& gap = problem.gap;
    const auto force = problem.room->solution.first(depth.size());
    Solved solved{};
    // Without a force heads stand highest: from there Newton's method comes from one side.
    if (!subtract(problem.heads, problem.share.line, problem.share.present, gap)) return solved;
    linearise(law, gap.place, gap.rate);
    int64_t rounds = 0;
    bool pivoted = false;
    for (int64_t number = 0; number < kMostTangents; ++number) {
        solved = solve(problem);
        if (solved.rounds <= 0 || !solved.finite) return solved;
        rounds += solved.rounds;
        pivoted = pivoted || solved.pivoted;
        linearise(law, depth, rate);
        const auto compensation = part(problem.room->solution, size(depth), solved.size);
        if (agrees(gap, problem.share.rows, force, compensation, law, number)) {
            solved.rounds = rounds;
            solved.pivoted = pivoted;
            return solved;
        }
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
