// A regulated lift.
#include "heads/regulation.hpp"

#include <algorithm>

namespace catenary {

namespace {

/// Part of a step by which a sample may come early: times are sums.
constexpr double kEarly = 1e-6;

ControlGains gains_at(std::span<const ControlGains> gains, double measured) {
    const int64_t n = size(gains);
    int64_t i = 0;
    while (i < n - 2 && gains[i + 1].measured <= measured) ++i;
    const ControlGains &low = gains[i], &high = gains[std::min(i + 1, n - 1)];
    double part = 0.0;
    if (&high != &low)
        part = std::clamp((measured - low.measured) / (high.measured - low.measured), 0.0, 1.0);
    return {measured, low.of_error + part * (high.of_error - low.of_error),
            low.of_integral + part * (high.of_integral - low.of_integral),
            low.of_rate + part * (high.of_rate - low.of_rate)};
}

}  // namespace

void regulate(const Regulation& regulation, double measured) {
    const RegulationSettings& settings = regulation.settings.front();
    RegulationMemory& memory = regulation.memory.front();
    memory.time += settings.dt;
    if (memory.samples < 0.0) {
        // The first step begins where it is: a filter has no start of its own.
        memory.filtered = measured;
        memory.samples = 0.0;
    }
    memory.filtered += settings.part * (measured - memory.filtered);
    if (memory.time < memory.next - kEarly * settings.dt) return;
    memory.next += settings.sample;
    const double error = settings.target - memory.filtered;
    const ControlGains gains = gains_at(regulation.gains, memory.filtered);
    const double rate = memory.samples == 0.0 ? 0.0 : (error - memory.error) / settings.sample;
    const double integral = memory.integral + settings.sample * error;
    const double wanted =
        gains.of_error * error + gains.of_integral * integral + gains.of_rate * rate;
    const double allowed = std::min(std::max(wanted, settings.least), settings.most);
    if ((settings.least <= wanted && wanted <= settings.most) ||
        (wanted - allowed) * gains.of_integral * error <= 0.0)
        memory.integral = integral;
    memory.error = error;
    if (regulation.waiting.empty()) {
        memory.acting = allowed;
    } else {
        double& waiting =
            regulation.waiting[static_cast<int64_t>(memory.samples) % size(regulation.waiting)];
        memory.acting = waiting;
        waiting = allowed;
    }
    memory.samples += 1.0;
}

}  // namespace catenary
