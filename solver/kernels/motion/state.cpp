// Loops over the motion of a rank's part of a line.
#include "motion/state.hpp"

#include "base/targets.hpp"

namespace catenary {

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
             std::span<double> acceleration, const Newmark& steps) {
    const Newmark s = steps;
    // Long lines wait for memory: what does not change is not written.
    const bool writes = s.damping_share != 0.0;
    for (size_t i = 0; i < displacement.size(); ++i) {
        const double v = velocity[i], a = acceleration[i] - s.damping_share * v;
        if (writes) acceleration[i] = a;
        velocity[i] = v + s.velocity_factor * a;
        displacement[i] += s.position_factor * a;
    }
}

CATENARY_FOR_TARGETS
void displacements(const Motion& motion, int64_t begin, std::span<double> result) {
    const Motion m = motion;
    const double a = m.shares[0], b = m.shares[1], c = m.shares[2];
    const int64_t n = size(result);
    const auto x = m.x.subspan(begin, n), y = m.y.subspan(begin, n), z = m.z.subspan(begin, n);
    for (int64_t i = 0; i < n; ++i) result[i] = a * x[i] + b * y[i] + c * z[i];
}

CATENARY_FOR_TARGETS
void velocities(const Motion& motion, int64_t begin, std::span<double> result) {
    const double b = motion.shares[3], c = motion.shares[4];
    const int64_t n = size(result);
    const auto y = motion.y.subspan(begin, n), z = motion.z.subspan(begin, n);
    for (int64_t i = 0; i < n; ++i) result[i] = b * y[i] + c * z[i];
}

}  // namespace catenary
