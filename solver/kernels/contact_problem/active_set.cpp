// LU factors of the rows that act, and the active-set iteration.
#include "contact_problem/active_set.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace catenary {

namespace {

/// Solve for two unknowns, with the operations in the same order as for more.
void solve_two(const System& system, int64_t first, int64_t second) {
    const auto& [matrix, right, solution] = system;
    const bool swaps = std::abs(matrix(second, first)) > std::abs(matrix(first, first));
    const int64_t top = swaps ? second : first, low = swaps ? first : second;
    const double share = matrix(low, first) / matrix(top, first);
    const double pivot = matrix(low, second) - share * matrix(top, second);
    double x = 0.0, y = 0.0;
    for (int pass = 0; pass < 2; ++pass) {
        const double of_top = right[top] - matrix(top, first) * x - matrix(top, second) * y;
        const double of_low = right[low] - matrix(low, first) * x - matrix(low, second) * y;
        const double change = (of_low - share * of_top) / pivot;
        y += change;
        x += (of_top - matrix(top, second) * change) / matrix(top, first);
    }
    solution[first] = x;
    solution[second] = y;
}

/// LU factors of the rows and columns `index`; row i of the factors was row order[i].
void eliminate(const Array2<double>& matrix, std::span<const int64_t> index,
               const Array2<double>& a, std::span<int64_t> order) {
    const int64_t m = size(index);
    std::iota(order.begin(), order.end(), 0);
    for (int64_t i = 0; i < m; ++i)
        for (int64_t j = 0; j < m; ++j) a(i, j) = matrix(index[i], index[j]);
    for (int64_t k = 0; k < m; ++k) {
        int64_t pivot = k;
        for (int64_t i = k + 1; i < m; ++i)
            if (std::abs(a(i, k)) > std::abs(a(pivot, k))) pivot = i;
        if (pivot != k) {
            std::swap(order[k], order[pivot]);
            for (int64_t j = 0; j < m; ++j) std::swap(a(k, j), a(pivot, j));
        }
        for (int64_t i = k + 1; i < m; ++i) {
            a(i, k) /= a(k, k);
            for (int64_t j = k + 1; j < m; ++j) a(i, j) -= a(i, k) * a(k, j);
        }
    }
}

}  // namespace

void solve_on(const System& system, std::span<const bool> acts, const Room& room) {
    const auto& [matrix, right, solution] = system;
    int64_t m = 0;
    for (int64_t i = 0; i < size(acts); ++i) {
        solution[i] = 0.0;
        if (acts[i]) room.acting[m++] = i;
    }
    const auto index = room.acting.first(m), order = room.order.first(m);
    // One or two contacts and taut droppers, mostly.
    if (m == 1) solution[index[0]] = right[index[0]] / matrix(index[0], index[0]);
    if (m == 2) solve_two(system, index[0], index[1]);
    if (m < 3) return;
    const Array2<double>& a = room.factors;
    const auto left = room.left.first(m), change = room.change.first(m);
    eliminate(matrix, index, a, order);
    for (int pass = 0; pass < 2; ++pass) {
        for (int64_t i = 0; i < m; ++i) {
            double value = right[index[i]];
            for (int64_t j = 0; j < m; ++j)
                value -= matrix(index[i], index[j]) * solution[index[j]];
            left[i] = value;
        }
        for (int64_t i = 0; i < m; ++i) {
            double value = left[order[i]];
            for (int64_t j = 0; j < i; ++j) value -= a(i, j) * change[j];
            change[i] = value;
        }
        for (int64_t i = m - 1; i >= 0; --i) {
            double value = change[i];
            for (int64_t j = i + 1; j < m; ++j) value -= a(i, j) * change[j];
            change[i] = value / a(i, i);
            solution[index[i]] += change[i];
        }
    }
}

int64_t settle(const System& system, const Signs& signs, int64_t max_rounds, const Room& room) {
    const auto& [matrix, right, solution] = system;
    const auto& [always, behind] = signs;
    const int64_t n = size(right);
    const auto acts = room.acts.first(n), before = room.before.first(n);
    for (int64_t i = 0; i < n; ++i)
        acts[i] = behind[i] ? acts[i - behind[i]] : always[i] || right[i] > 0.0;
    int64_t kept_at = 1;
    for (int64_t rounds = 1; rounds <= max_rounds; ++rounds) {
        // Each set determines the next one: a set that comes again is in a cycle. One is kept for
        // twice as many rounds as the one before it (R. P. Brent, BIT 20 (1980) 176-184).
        if (rounds == kept_at) {
            std::ranges::copy(acts, before.begin());
            kept_at *= 2;
        }
        solve_on(system, acts, room);
        bool changed = false;
        for (int64_t i = 0; i < n; ++i) {
            if (behind[i]) {
                acts[i] = acts[i - behind[i]];
                continue;
            }
            double residual = -right[i];
            for (int64_t j = 0; j < n; ++j) residual += matrix(i, j) * solution[j];
            const bool now = always[i] || solution[i] - residual > 0.0;
            changed = changed || now != acts[i];
            acts[i] = now;
        }
        if (!changed) return rounds;
        if (std::ranges::equal(acts, before)) return -rounds;
    }
    return -max_rounds;
}

}  // namespace catenary
