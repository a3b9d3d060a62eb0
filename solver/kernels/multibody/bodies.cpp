// Rigid bodies in space, rows of joints, and lines of forces between bodies.
#include "multibody/bodies.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace catenary {

namespace {

Vector3 sum(const Vector3& a, const Vector3& b) {
    return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
Vector3 difference(const Vector3& a, const Vector3& b) {
    return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
Vector3 cross(const Vector3& a, const Vector3& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
double dot(const Vector3& a, const Vector3& b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
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

namespace {

/// A point fixed on a body: arm from the body's centre, and the point's place, velocity and
/// centripetal acceleration.
struct PointOnBody {
    Vector3 arm, place, velocity, inward;
};
PointOnBody point_on(const BodyMotion& motion, int64_t body, const Vector3& local) {
    const Vector3 arm = motion.turned(body, local), turning = motion.turning(body);
    const Vector3 moving = cross(turning, arm);
    return {arm, sum(vector(motion.position[body]), arm),
            sum(vector(motion.velocity[body]), moving), cross(turning, moving)};
}

/// Add to a row (6 n,) the gradient of (velocity of a body's centre) . `way`; the frame has none.
void add_shift(const BodyMotion& motion, int64_t body, const Vector3& way, double sign,
               std::span<double> row) {
    if (body >= motion.n_bodies()) return;
    for (int64_t k = 0; k < 3; ++k) row[6 * body + k] += sign * way[k];
}

/// Add that of (angular velocity of a body) . `way`, in body axes.
void add_moment(const BodyMotion& motion, int64_t body, const Vector3& way, double sign,
                std::span<double> row) {
    if (body >= motion.n_bodies()) return;
    const Array2<const double> matrix = motion.rotation[body];
    for (int64_t k = 0; k < 3; ++k)
        row[6 * body + 3 + k] +=
            sign * (matrix(0, k) * way[0] + matrix(1, k) * way[1] + matrix(2, k) * way[2]);
}

/// A vector in space with its rate, and the part of its second rate without accelerations.
struct Way {
    Vector3 value, rate, drift;
};

}  // namespace

void body_products(const BodyMotion& motion, std::span<const BodyProduct> rows,
                   const BodyProducts& result) {
    std::ranges::fill(result.jacobian.all(), 0.0);
    for (int64_t r = 0; r < size(rows); ++r) {
        const BodyProduct& own = rows[r];
        const auto row = result.jacobian[r];
        const Vector3 normal = motion.turned(own.body, own.normal);
        const Vector3 turning = motion.turning(own.body);
        const Vector3 normal_rate = cross(turning, normal);
        const PointOnBody end = point_on(motion, own.end, own.at_end);
        Way way;
        if (own.between) {
            const PointOnBody start = point_on(motion, own.start, own.at_start);
            way = {difference(end.place, start.place), difference(end.velocity, start.velocity),
                   difference(end.inward, start.inward)};
            add_shift(motion, own.end, normal, 1.0, row);
            add_shift(motion, own.start, normal, -1.0, row);
            add_moment(motion, own.start, cross(start.arm, normal), -1.0, row);
        } else {
            way = {end.arm, cross(motion.turning(own.end), end.arm), end.inward};
        }
        add_moment(motion, own.end, cross(end.arm, normal), 1.0, row);
        add_moment(motion, own.body, cross(normal, way.value), 1.0, row);
        result.value[r] = dot(normal, way.value);
        result.rate[r] = dot(normal, way.rate) + dot(normal_rate, way.value);
        result.drift[r] = dot(normal, way.drift) + 2.0 * dot(normal_rate, way.rate) +
                          dot(cross(turning, normal_rate), way.value);
    }
}

void body_lines(const BodyMotion& motion, std::span<const BodyLine> lines,
                const BodyLines& result) {
    std::ranges::fill(result.gradient.all(), 0.0);
    for (int64_t r = 0; r < size(lines); ++r) {
        const BodyLine& own = lines[r];
        const auto row = result.gradient[r];
        const PointOnBody start = point_on(motion, own.i, own.at_i);
        const PointOnBody end = point_on(motion, own.j, own.at_j);
        const Vector3 way = difference(end.place, start.place);
        const double far = std::sqrt(dot(way, way));
        const Vector3 unit{way[0] / far, way[1] / far, way[2] / far};
        result.length[r] = far;
        result.rate[r] = dot(unit, difference(end.velocity, start.velocity));
        add_shift(motion, own.j, unit, 1.0, row);
        add_moment(motion, own.j, cross(end.arm, unit), 1.0, row);
        add_shift(motion, own.i, unit, -1.0, row);
        add_moment(motion, own.i, cross(start.arm, unit), -1.0, row);
    }
}

std::vector<int64_t> independent_rows(Array2<const double> matrix, double dependent) {
    const int64_t width = matrix.columns, most = std::min(matrix.rows, width);
    std::vector<double> numbers(most * width), left(width);
    const Array2<double> basis{numbers.data(), most, width};
    const std::span<double> rest(left);
    const auto product = [](std::span<const double> row, std::span<const double> other) {
        return std::inner_product(row.begin(), row.end(), other.begin(), 0.0);
    };
    std::vector<int64_t> kept;
    for (int64_t r = 0; r < matrix.rows; ++r) {
        std::ranges::copy(matrix[r], rest.begin());
        const double whole = std::sqrt(product(rest, rest));
        for (int time = 0; time < 2; ++time)
            for (int64_t b = 0; b < static_cast<int64_t>(kept.size()); ++b) {
                const auto one = basis[b];
                const double share = product(one, rest);
                if (share == 0.0) continue;
                for (int64_t k = 0; k < width; ++k) rest[k] -= share * one[k];
            }
        const double length = std::sqrt(product(rest, rest));
        if (!(length > dependent * whole)) continue;
        // Rows beyond the number of columns are combinations, whatever the round-off.
        if (static_cast<int64_t>(kept.size()) == most) break;
        const auto next = basis[static_cast<int64_t>(kept.size())];
        for (int64_t k = 0; k < width; ++k) next[k] = rest[k] / length;
        kept.push_back(r);
    }
    return kept;
}

}  // namespace catenary
