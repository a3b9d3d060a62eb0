// Rigid bodies in space.
#include "multibody/bodies.hpp"

#include <cmath>

namespace catenary {

namespace {

Vector3 vector(std::span<const double> row) {
    return {row[0], row[1], row[2]};
}

}  // namespace

Vector3 BodyMotion::turned(int64_t body, const Vector3& local) const {
    const Array2<const double> matrix = rotation[body];
    return {dot(vector(matrix[0]), local), dot(vector(matrix[1]), local),
            dot(vector(matrix[2]), local)};
}

Vector3 BodyMotion::turning(int64_t body) const {
    return turned(body, vector(spin[body]));
}

PointOnBody point_on(const BodyMotion& motion, int64_t body, const Vector3& local) {
    const Vector3 arm = motion.turned(body, local), turning = motion.turning(body);
    const Vector3 moving = cross(turning, arm);
    return {arm, sum(vector(motion.position[body]), arm),
            sum(vector(motion.velocity[body]), moving), cross(turning, moving)};
}

void add_shift(const BodyMotion& motion, int64_t body, const Vector3& way, double sign,
               std::span<double> row) {
    if (body >= motion.n_bodies()) return;
    for (int64_t k = 0; k < 3; ++k) row[6 * body + k] += sign * way[k];
}

void add_moment(const BodyMotion& motion, int64_t body, const Vector3& way, double sign,
                std::span<double> row) {
    if (body >= motion.n_bodies()) return;
    const Array2<const double> matrix = motion.rotation[body];
    for (int64_t k = 0; k < 3; ++k)
        row[6 * body + 3 + k] +=
            sign * (matrix(0, k) * way[0] + matrix(1, k) * way[1] + matrix(2, k) * way[2]);
}

void rotation_matrices(Array2<const double> parameters, Array3<double> rotation) {
    for (int64_t i = 0; i < parameters.rows; ++i) {
        const auto e = parameters[i];
        const double e0 = e[0], e1 = e[1], e2 = e[2], e3 = e[3];
        const Array2<double> matrix = rotation[i];
        matrix(0, 0) = 2.0 * (e0 * e0 + e1 * e1 - 0.5);
        matrix(0, 1) = 2.0 * (e1 * e2 - e0 * e3);
        matrix(0, 2) = 2.0 * (e1 * e3 + e0 * e2);
        matrix(1, 0) = 2.0 * (e1 * e2 + e0 * e3);
        matrix(1, 1) = 2.0 * (e0 * e0 + e2 * e2 - 0.5);
        matrix(1, 2) = 2.0 * (e2 * e3 - e0 * e1);
        matrix(2, 0) = 2.0 * (e1 * e3 - e0 * e2);
        matrix(2, 1) = 2.0 * (e2 * e3 + e0 * e1);
        matrix(2, 2) = 2.0 * (e0 * e0 + e3 * e3 - 0.5);
    }
}

void move_bodies(Array2<double> position, Array2<double> parameters, std::span<const double> step) {
    for (int64_t i = 0; i < position.rows - 1; ++i) {
        const auto own = part(step, 6 * i, 6 * i + 6);
        for (int64_t k = 0; k < 3; ++k) position(i, k) += own[k];
        const double x = 0.5 * own[3], y = 0.5 * own[4], z = 0.5 * own[5];
        const double half = std::sqrt(x * x + y * y + z * z);
        const double factor = half > 0.0 ? std::sin(half) / half : 1.0;
        const double r0 = std::cos(half), r1 = factor * x, r2 = factor * y, r3 = factor * z;
        const auto p = parameters[i];
        const double q0 = p[0] * r0 - p[1] * r1 - p[2] * r2 - p[3] * r3;
        const double q1 = p[0] * r1 + p[1] * r0 + p[2] * r3 - p[3] * r2;
        const double q2 = p[0] * r2 + p[2] * r0 + p[3] * r1 - p[1] * r3;
        const double q3 = p[0] * r3 + p[3] * r0 + p[1] * r2 - p[2] * r1;
        const double norm = std::sqrt(q0 * q0 + q1 * q1 + q2 * q2 + q3 * q3);
        p[0] = q0 / norm;
        p[1] = q1 / norm;
        p[2] = q2 / norm;
        p[3] = q3 / norm;
    }
}

void add_gyroscopic_moments(std::span<double> force, Array2<const double> inertia,
                            Array2<const double> spin) {
    for (int64_t i = 0; i < inertia.rows; ++i) {
        const auto j = inertia[i];
        const double x = spin(i, 0), y = spin(i, 1), z = spin(i, 2);
        force[6 * i + 3] -= (j[2] - j[1]) * y * z;
        force[6 * i + 4] -= (j[0] - j[2]) * z * x;
        force[6 * i + 5] -= (j[1] - j[0]) * x * y;
    }
}

}  // namespace catenary
