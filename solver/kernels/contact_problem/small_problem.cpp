// The matrix of the small problem from influence coefficients, and depths under its solution.
#include "contact_problem/small_problem.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace catenary {

namespace {

/// Whether contact forces (n,) alone take any of the first `count` links beyond its reserve.
bool any_switched(const LinkRows& rows, int64_t count, const Coupled& coupled,
                  std::span<const double> force) {
    if (count > rows.capacity()) throw std::out_of_range("there are fewer rows of links");
    for (int64_t d = 0; d < count; ++d) part(coupled.released, rows.number(d), rows.number(d) + 1);
    for (int64_t d = 0; d < count; ++d) {
        if (coupled.behind[rows.number(d)] > 0) continue;
        double value = rows.reserve(d);
        for (int64_t i = 0; i < size(force); ++i) value += rows.reaction(d, i) * force[i];
        if (value < 0.0) return true;
    }
    return false;
}

}  // namespace

void couple(const LinkRows& rows, int64_t count, const Coupled& coupled,
            std::span<const double> by_depth, std::span<const double> by_rate, const Room& room) {
    const auto& band = coupled.band;
    const auto& matrix = room.matrix;
    const int64_t n = size(by_depth), half = band.columns / 2;
    for (int64_t d = 0; d < count; ++d) {
        const int64_t row = n + d, number = rows.number(d);
        const double released = coupled.released[number];
        room.behind[row] = coupled.behind[number];
        room.right[row] = -released * rows.reserve(d);
        for (int64_t i = 0; i < n; ++i) {
            matrix(row, i) = released * rows.reaction(d, i);
            matrix(i, row) = -(by_depth[i] * rows.lift(d, i) + by_rate[i] * rows.rise(d, i));
        }
        for (int64_t e = 0; e < count; ++e) {
            const int64_t other = rows.number(e), offset = number - other + half;
            const bool near = 0 <= offset && offset < band.columns;
            matrix(row, n + e) = near ? -released * band(other, offset) : 0.0;
        }
        matrix(row, row) += 1.0;
    }
}

bool subtract(const Affine& heads, const Affine& line, std::span<const double> present,
              const Affine& gap) {
    double total = 0.0;
    for (int64_t i = 0; i < size(gap.place); ++i) {
        const bool there = present[i] != 0.0;
        gap.place[i] = there ? heads.place[i] - line.place[i] : kNowhere;
        gap.rate[i] = there ? heads.rate[i] - line.rate[i] : 0.0;
        total += gap.place[i] + gap.rate[i];
        for (int64_t j = 0; j < size(gap.place); ++j) {
            gap.by_force(i, j) = present[i] * (heads.by_force(i, j) + line.by_force(i, j));
            gap.rate_by_force(i, j) =
                present[i] * (heads.rate_by_force(i, j) + line.rate_by_force(i, j));
            total += gap.by_force(i, j) + gap.rate_by_force(i, j);
        }
    }
    return std::isfinite(total);
}

void press(const Affine& gap, const Tangents& tangents, const Room& room) {
    const auto& [own, offset, by_depth, by_rate] = tangents;
    const auto& [depth, rate, by_force, rate_by_force] = gap;
    for (int64_t i = 0; i < size(depth); ++i) {
        room.right[i] = offset[i] + by_depth[i] * depth[i] + by_rate[i] * rate[i];
        for (int64_t j = 0; j < size(depth); ++j)
            room.matrix(i, j) = by_depth[i] * by_force(i, j) + by_rate[i] * rate_by_force(i, j);
        room.matrix(i, i) += own[i];
    }
}

Found slack_under(const LinkRows& rows, int64_t count, const Coupled& coupled,
                  std::span<const double> force, int64_t max_rounds, const Room& room) {
    std::ranges::fill(part(room.solution, 0, count), 0.0);
    if (!any_switched(rows, count, coupled, force)) return {1, false};
    couple(rows, count, coupled, {}, {}, room);
    for (int64_t d = 0; d < count; ++d) {
        room.always[d] = false;
        for (int64_t i = 0; i < size(force); ++i)
            room.right[d] -= coupled.released[rows.number(d)] * rows.reaction(d, i) * force[i];
    }
    return find_solution(room.system(count), room.signs(count), max_rounds, room);
}

bool under(const Affine& gap, const LinkRows& rows, std::span<const double> force,
           std::span<const double> compensation, const Depths& found) {
    double total = 0.0;
    for (int64_t i = 0; i < size(force); ++i) {
        double depth = gap.place[i], rate = gap.rate[i];
        for (int64_t j = 0; j < size(force); ++j) {
            depth -= gap.by_force(i, j) * force[j];
            rate -= gap.rate_by_force(i, j) * force[j];
        }
        for (int64_t k = 0; k < size(compensation); ++k) {
            depth += rows.lift(k, i) * compensation[k];
            rate += rows.rise(k, i) * compensation[k];
        }
        found.depth[i] = depth;
        found.rate[i] = rate;
        total += depth + rate;
    }
    return std::isfinite(total);
}

bool leaves_out(std::span<const double> force, std::span<const double> compensation,
                const LinkRows& rows, const Bounds& bounds, const Coupled& coupled) {
    const auto& [band, released, slackens, behind, drop] = coupled;
    const int64_t half = band.columns / 2, n = size(drop), m = size(compensation);
    if (n == 0) return false;
    for (size_t i = 0; i < force.size(); ++i)
        if (force[i] > bounds.push[i] || -force[i] > bounds.pull[i]) return true;
    for (int64_t k = 0; k < m; ++k) {
        if (compensation[k] == 0.0) continue;
        const int64_t e = rows.number(k), end = std::min(n, e + half + 1);
        for (int64_t d = std::max<int64_t>(0, e - half); d < end; ++d)
            if (released[d] > 0.0 && behind[d] == 0)
                drop[d] += compensation[k] * band(e, d - e + half);
    }
    for (int64_t k = 0; k < m; ++k) drop[rows.number(k)] = 0.0;
    double largest = 0.0;
    for (int64_t k = 0; k < m; ++k) {
        if (compensation[k] == 0.0) continue;
        const int64_t e = rows.number(k), end = std::min(n, e + half + 1);
        for (int64_t d = std::max<int64_t>(0, e - half); d < end; ++d) {
            largest = std::max(largest, drop[d]);
            drop[d] = 0.0;
        }
    }
    return largest > bounds.loss[0];
}

Solved solve(const SmallProblem& problem) {
    const auto& [heads, share, gap, pulls, tangents, coupled, to_solve_in, found, max_rounds] =
        problem;
    const auto& rows = share.rows;
    const int64_t n = size(gap.place), count = static_cast<int64_t>(share.flags[0].rows);
    if (!to_solve_in || n + count > to_solve_in->k || count > rows.capacity()) return {};
    const Room& room = *to_solve_in;
    bool finite = subtract(heads, share.line, share.present, gap);
    for (int64_t i = 0; i < n; ++i) {
        room.always[i] = pulls && share.present[i] != 0.0;
        room.behind[i] = 0;
    }
    press(gap, tangents, room);
    const auto force = room.solution.first(n);
    auto find_first = [&](int64_t of) {
        return find_solution(room.system(of), room.signs(of), max_rounds, room);
    };
    Found forces = find_first(n);
    int64_t used = n;
    if (forces.rounds > 0 && any_switched(rows, count, coupled, force)) {
        couple(rows, count, coupled, tangents.by_depth, tangents.by_rate, room);
        used = n + count;
        const Found all = find_first(used);
        forces = {all.rounds, all.pivoted || forces.pivoted};
    }
    const auto compensation = part(room.solution, n, used);
    finite = under(gap, rows, force, compensation, found) && finite;
    const bool complete = !leaves_out(force, compensation, rows, share.bounds, coupled);
    return {forces.rounds, used, finite, complete, forces.pivoted};
}

}  // namespace catenary
