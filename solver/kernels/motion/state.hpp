#pragma once
// The motion of a rank's part of a line, as it is read at single unknowns.
#include "base/arrays.hpp"

namespace catenary {

/// Displacement d = s0 x + s1 y + s2 z and velocity v = s3 y + s4 z at the end of the latest step,
/// with x, y and z (n_local,) that a step carries on, and five shares. Numbers of an unknown are
/// `spacing` behind the numbers of the one before: more than one where scenes stand in lanes.
struct Motion {
    std::span<double> x, y, z;
    std::span<const double> shares;
    int64_t spacing = 1;
    CATENARY_RECORD(x, y, z, shares, spacing)
    CATENARY_SHAPES("n, n, n, 5")
};

inline double displacement_at(int64_t unknown, const Motion& motion) {
    const auto& s = motion.shares;
    const int64_t at = unknown * motion.spacing;
    return s[0] * motion.x[at] + s[1] * motion.y[at] + s[2] * motion.z[at];
}
inline double velocity_at(int64_t unknown, const Motion& motion) {
    const int64_t at = unknown * motion.spacing;
    return motion.shares[3] * motion.y[at] + motion.shares[4] * motion.z[at];
}

/// Fill in the largest |x| of each motion side by side, and then the largest |y|, at the unknowns
/// from `begin` to `end`.
void find_peak(const Motion& motion, int64_t begin, int64_t end, std::span<double> peak);
/// Whether one of these unknowns moves by more than a share of such a `peak`, or holds NaN.
bool moves(const Motion& motion, int64_t begin, int64_t end, std::span<const double> peak,
           double share);

/// Factors of a step of Newmark's method.
struct Newmark {
    double dt;                                  ///< [s]
    double predict_position, predict_velocity;  ///< of the acceleration before in predictions of
                                                ///< displacement [s2], velocity [s]
    double work_velocity;                       ///< c of d + c v, see `Alpha`
    double position_factor, velocity_factor;    ///< of the acceleration after the step [s2], [s]
    double damping_share;  ///< of damping on mass that the acceleration lacks [1/s]
    CATENARY_RECORD(dt, predict_position, predict_velocity, work_velocity, position_factor,
                    velocity_factor, damping_share)
};
/// Predictions in place (eq. 2.5); `work` becomes -(d + `work_velocity` v).
void predict(std::span<double> displacement, std::span<double> velocity,
             std::span<const double> acceleration, std::span<double> work, const Newmark& steps);
/// New displacement and velocity from predictions and acceleration (eq. 2.6). The acceleration
/// still lacks -`damping_share` v, the part of damping on mass.
void correct(std::span<double> displacement, std::span<double> velocity,
             std::span<double> acceleration, double position_factor, double velocity_factor,
             double damping_share);

/// Factors of a step's predictions by the accelerations of the generalized-alpha method. With b the
/// acceleration that balances the forces at the end of a step, the algorithm's is a = p + r b,
/// where p is known when the step begins.
struct Alpha {
    double dt, ratio;                           ///< [s], r
    double known_of_balanced, known_of_own;     ///< shares of b and a before in p
    double position_of_own, position_of_known;  ///< of a before and p in the displacement [s2]
    double velocity_of_own, velocity_of_known;  ///< and in the velocity [s]
    double damping_on_stiffness;  ///< c, so that K (d + c v) has the forces of damping on K, too
    CATENARY_RECORD(dt, ratio, known_of_balanced, known_of_own, position_of_own, position_of_known,
                    velocity_of_own, velocity_of_known, damping_on_stiffness)
};
/// Predictions in place from b and p of the step before. `known` becomes the p of this step, and
/// `work` -(d + c v).
void predict_alpha(std::span<double> displacement, std::span<double> velocity,
                   std::span<const double> balanced, std::span<double> known,
                   std::span<double> work, const Alpha& by);

/// Fill in displacements, velocities, of the unknowns from `begin` on.
void displacements(const Motion& motion, int64_t begin, std::span<double> result);
void velocities(const Motion& motion, int64_t begin, std::span<double> result);

}  // namespace catenary
