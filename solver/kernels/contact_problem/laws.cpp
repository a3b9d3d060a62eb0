// Tangents of Hertz's law with hysteresis, and reported forces.
#include "contact_problem/laws.hpp"

#include <algorithm>
#include <cmath>

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

}  // namespace catenary
