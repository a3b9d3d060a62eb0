#pragma once
// Rigid bodies in space: where n bodies are and how they move, the frame at rest being one more.
#include <array>

#include "base/arrays.hpp"

namespace catenary {

using Vector3 = std::array<double, 3>;

inline Vector3 sum(const Vector3& a, const Vector3& b) {
    return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
inline Vector3 difference(const Vector3& a, const Vector3& b) {
    return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
inline Vector3 cross(const Vector3& a, const Vector3& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
inline double dot(const Vector3& a, const Vector3& b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/// See `Motion` of mbs/rigid/bodies.py.
struct BodyMotion {
    Array2<const double> position;  ///< (n + 1, 3) [m]
    Array3<const double> rotation;  ///< (n + 1, 3, 3) from body to space axes
    Array2<const double> velocity;  ///< (n + 1, 3) [m/s], in space axes
    Array2<const double> spin;      ///< (n + 1, 3) [rad/s], in body axes
    CATENARY_RECORD(position, rotation, velocity, spin)
    CATENARY_SHAPES("n+1 3, n+1 3 3, n+1 3, n+1 3")

    int64_t n_bodies() const { return position.rows - 1; }
    /// A vector in body axes, in space axes.
    Vector3 turned(int64_t body, const Vector3& local) const;
    /// The angular velocity in space axes.
    Vector3 turning(int64_t body) const;
};

/// A point fixed on a body: arm from the body's centre, and the point's place, velocity and
/// centripetal acceleration.
struct PointOnBody {
    Vector3 arm, place, velocity, inward;
};
PointOnBody point_on(const BodyMotion& motion, int64_t body, const Vector3& local);

/// Add to a row (6 n,) the gradient of (velocity of a body's centre) . `way`; the frame has none.
void add_shift(const BodyMotion& motion, int64_t body, const Vector3& way, double sign,
               std::span<double> row);
/// Add that of (angular velocity of a body) . `way`, in body axes.
void add_moment(const BodyMotion& motion, int64_t body, const Vector3& way, double sign,
                std::span<double> row);

/// Fill in matrices (n, 3, 3) from body to space axes of unit Euler parameters (n, 4).
void rotation_matrices(Array2<const double> parameters, Array3<double> rotation);
/// Displace bodies in place by `step` (6 n,): translations, then turns in body axes. Euler
/// `parameters` (n + 1, 4) are normalised after the turn; `position` is (n + 1, 3).
void move_bodies(Array2<double> position, Array2<double> parameters, std::span<const double> step);
/// Add -omega x J omega to generalised forces (6 n,) in place; `inertia` (n, 3), `spin` (n + 1, 3).
void add_gyroscopic_moments(std::span<double> force, Array2<const double> inertia,
                            Array2<const double> spin);

}  // namespace catenary
