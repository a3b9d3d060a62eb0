// Sums of influence functions, in windows.
#include "contact/columns.hpp"

#include <algorithm>

#include "base/targets.hpp"

namespace catenary {

namespace {

/// Columns of a node's two unknowns, or parts of them, with their weights.
struct Pair {
    const double *by_height, *by_slope;
    double height, slope;
    Pair from(int64_t begin) const { return {by_height + begin, by_slope + begin, height, slope}; }
};

Pair columns_of(const Node& node, std::span<const double> data, double height, double slope) {
    const int64_t n = 2 * std::max<int64_t>(0, node.width);
    const double* first = n > 0 ? part(data, node.at, node.at + n).data() : nullptr;
    return {first, first + node.width, height, slope};
}

CATENARY_FOR_TARGETS
void put_both(double* __restrict answer, int64_t n, Pair one, Pair other) {
    for (int64_t j = 0; j < n; ++j) {
        const double of_one = one.height * one.by_height[j] + one.slope * one.by_slope[j];
        answer[j] = of_one + (other.height * other.by_height[j] + other.slope * other.by_slope[j]);
    }
}

CATENARY_FOR_TARGETS
void add_one(double* __restrict answer, int64_t n, Pair one) {
    for (int64_t j = 0; j < n; ++j)
        answer[j] += one.height * one.by_height[j] + one.slope * one.by_slope[j];
}

CATENARY_FOR_TARGETS
void add_to_motion(double force, const double* __restrict answer, int64_t n, double* __restrict x,
                   double* __restrict y, double* __restrict z, const double* gains) {
    const double to_x = gains[0], to_y = gains[1], to_z = gains[2];
    for (int64_t j = 0; j < n; ++j) {
        const double change = force * answer[j];
        z[j] += to_z * change;
        x[j] += to_x * change;
        y[j] += to_y * change;
    }
}

/// The same for one scene in lanes: its numbers are `spacing` apart.
void add_to_lane(double force, const double* __restrict answer, int64_t n, int64_t spacing,
                 double* __restrict x, double* __restrict y, double* __restrict z,
                 const double* gains) {
    const double to_x = gains[0], to_y = gains[1], to_z = gains[2];
    for (int64_t j = 0, at = 0; j < n; ++j, at += spacing) {
        const double change = force * answer[j];
        z[at] += to_z * change;
        x[at] += to_x * change;
        y[at] += to_y * change;
    }
}

}  // namespace

void clear(std::span<double> answer, int64_t low, int64_t high) {
    if (low < high) std::ranges::fill(part(answer, low, high), 0.0);
}

void put_columns(const Node* nodes, std::span<const double> data, const double (&weights)[4],
                 std::span<double> answer, int64_t (&filled)[2]) {
    const Node &first = nodes[0], &second = nodes[1];
    const int64_t low = first.begin, high = low + first.width;
    const int64_t last = second.begin, end = last + second.width;
    const Pair one = columns_of(first, data, weights[0], weights[1]);
    const Pair other = columns_of(second, data, weights[2], weights[3]);
    if (!(low <= last && last < high && high <= end)) {
        // One without columns, as beyond a run, or windows that do not overlap.
        clear(answer, filled[0], filled[1]);
        filled[0] = size(answer);
        filled[1] = 0;
        for (int side = 0; side < 2; ++side) {
            const Node& node = nodes[side];
            if (node.width <= 0) continue;
            add_one(part(answer, node.begin, node.begin + node.width).data(), node.width,
                    side ? other : one);
            filled[0] = std::min<int64_t>(filled[0], node.begin);
            filled[1] = std::max<int64_t>(filled[1], node.begin + node.width);
        }
        filled[0] = std::min(filled[0], filled[1]);
        return;
    }
    // Windows of neighbours are nearly the same: their common part is written once.
    clear(answer, std::min(filled[0], low), last);
    clear(answer, high, std::max(filled[1], end));
    double* whole = part(answer, low, end).data();
    add_one(whole, last - low, one);
    put_both(whole + (last - low), high - last, one.from(last - low), other);
    add_one(whole + (high - low), end - high, other.from(high - last));
    filled[0] = low;
    filled[1] = end;
}

void add_answer(double force, std::span<const double> answer, int64_t begin, const Motion& motion,
                std::span<const double> gains) {
    const int64_t n = size(answer), spacing = motion.spacing;
    if (n == 0) return;
    const auto of = [&](std::span<double> all) {
        return part(all, begin * spacing, (begin + n - 1) * spacing + 1).data();
    };
    double *const x = of(motion.x), *const y = of(motion.y), *const z = of(motion.z);
    if (spacing == 1)
        add_to_motion(force, answer.data(), n, x, y, z, gains.data());
    else
        add_to_lane(force, answer.data(), n, spacing, x, y, z, gains.data());
}

}  // namespace catenary
