#include "contact_problem/forces.hpp"

namespace catenary {

int64_t find_forces(double time, const SmallProblem& problem, const ReportedForces& law,
                    std::span<int64_t> switched, Counts& counts) {
    const Flags& flags = problem.share.flags[0];
    const auto solution = problem.unknowns.solution;
    const int64_t n = size(problem.gap.place);
    if (flags.broken != 0.0 || flags.missing != 0.0) return kLeft;
    if (n + static_cast<int64_t>(flags.rows) > size(solution)) return kLeft;
    const Solved solved = solve(problem);
    if (solved.rounds <= 0 || !solved.finite) return kLeft;
    if (!solved.complete) return kTooSmall;
    if (!report(time, solution.first(n), law)) return kLeft;
    counts.rounds += solved.rounds;
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
