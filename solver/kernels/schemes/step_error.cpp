// The estimate of a step's error.
#include "schemes/step_error.hpp"

#include <algorithm>
#include <cmath>

namespace catenary {

double step_error(const TriedStep& tried, const PastSteps& past, double time) {
    const auto t = past.times;
    const auto& depths = past.depths;
    double largest = 0.0;
    for (int64_t i = 0; i < size(tried.depth); ++i) {
        const double before = past.forces[i], now = tried.force[i];
        if (before > 0.0 || now > 0.0) {
            const double first = (tried.depth[i] - depths(2, i)) / (time - t[2]);
            const double second = (depths(2, i) - depths(1, i)) / (t[2] - t[1]);
            const double third = (depths(1, i) - depths(0, i)) / (t[1] - t[0]);
            const double change =
                (first - second) / (time - t[1]) - (second - third) / (t[2] - t[0]);
            const double step = time - t[2];
            const double missed = step * step / 6.0 * std::fabs(change);
            largest = std::max(largest, tried.stiffness[i] * missed);
        }
        if ((before > 0.0) != (now > 0.0)) {
            const double turned = std::sqrt(tried.stiffness[i] * tried.compliance[i]);
            largest = std::max(largest, turned * std::max(before, now));
        }
    }
    return largest;
}

void accept_step(const TriedStep& tried, const PastSteps& past, double time) {
    const auto times = past.times, depths = past.depths.all();
    std::copy(times.begin() + 1, times.end(), times.begin());
    times.back() = time;
    std::copy(depths.begin() + past.depths.columns, depths.end(), depths.begin());
    std::copy(tried.depth.begin(), tried.depth.end(), depths.end() - past.depths.columns);
    std::copy(tried.force.begin(), tried.force.end(), past.forces.begin());
}

}  // namespace catenary
