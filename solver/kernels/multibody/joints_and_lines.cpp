// Rows of joints and lines of forces between bodies.
#include "multibody/joints_and_lines.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace catenary {

namespace {

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
