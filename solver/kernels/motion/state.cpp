// Loops over the motion of a rank's part of a line.
#include "motion/state.hpp"

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
             std::span<const double> acceleration, std::span<double> work, const Newmark& steps) {
    const Newmark s = steps;
    for (size_t i = 0; i < displacement.size(); ++i) {
        const double d =
            displacement[i] + s.dt * velocity[i] + s.predict_position * acceleration[i];
        const double v = velocity[i] + s.predict_velocity * acceleration[i];
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
void predict_alpha(std::span<double> displacement, std::span<double> velocity,
                   std::span<const double> balanced, std::span<double> known,
                   std::span<double> work, const Alpha& by) {
    const Alpha s = by;
    for (size_t i = 0; i < displacement.size(); ++i) {
        const double b = balanced[i], a = known[i] + s.ratio * b;
        const double p = s.known_of_balanced * b + s.known_of_own * a;
        const double d =
            displacement[i] + s.dt * velocity[i] + s.position_of_own * a + s.position_of_known * p;
        const double v = velocity[i] + s.velocity_of_own * a + s.velocity_of_known * p;
        known[i] = p;
        displacement[i] = d;
        velocity[i] = v;
        work[i] = -(d + s.damping_on_stiffness * v);
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

}  // namespace catenary
