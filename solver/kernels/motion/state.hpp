#pragma once
// The motion of a rank's part of a line, as it is read at single unknowns.
#include "base/arrays.hpp"
#include "base/record.hpp"

namespace catenary {

/// Displacement d = s0 x + s1 y + s2 z and velocity v = s3 y + s4 z at the end of the latest step,
/// with x, y and z (n_local,) that a step carries on, and five shares.
struct Motion {
    std::span<double> x, y, z;
    std::span<const double> shares;
    CATENARY_RECORD(x, y, z, shares)
};

inline double displacement_at(int64_t unknown, const Motion& motion) {
    const auto& s = motion.shares;
    return s[0] * motion.x[unknown] + s[1] * motion.y[unknown] + s[2] * motion.z[unknown];
}
inline double velocity_at(int64_t unknown, const Motion& motion) {
    return motion.shares[3] * motion.y[unknown] + motion.shares[4] * motion.z[unknown];
}

/// Predictions of Newmark's method (eq. 2.5) in place; `work` becomes -(d + `c_work` v).
struct Newmark {
    double dt, predict_position, predict_velocity, work_velocity;
    double position_factor, velocity_factor, damping_share;
    CATENARY_RECORD(dt, predict_position, predict_velocity, work_velocity, position_factor,
                    velocity_factor, damping_share)
};
void predict(std::span<double> displacement, std::span<double> velocity,
             std::span<const double> acceleration, std::span<double> work, const Newmark& steps);
/// New displacement and velocity from predictions and acceleration (eq. 2.6). The acceleration
/// still lacks -`damping_share` v, the part of damping on mass.
void correct(std::span<double> displacement, std::span<double> velocity,
             std::span<double> acceleration, const Newmark& steps);

/// Fill in displacements, velocities, of the unknowns from `begin` on.
void displacements(const Motion& motion, int64_t begin, std::span<double> result);
void velocities(const Motion& motion, int64_t begin, std::span<double> result);

}  // namespace catenary
