// Loops over motions of the line side by side.
#include "tangents/tangent_lanes.hpp"

#include <algorithm>

#include "base/targets.hpp"
#include "contact/columns.hpp"

namespace catenary {

namespace {

/// Put the sums of the march's motion from unknown `begin` to `end` with the weights of a term.
template <int64_t L>
[[gnu::always_inline]] inline void add_up(const Motion& march, const double* weights, int64_t begin,
                                          int64_t end, double* sums) {
    const typename SideBySide<L>::Numbers by_x = SideBySide<L>::at(weights),
                                          by_y = SideBySide<L>::at(weights + L),
                                          by_z = SideBySide<L>::at(weights + 2 * L);
    const double *x = march.x.data(), *y = march.y.data(), *z = march.z.data();
    for (int64_t u = begin; u < end; ++u)
        SideBySide<L>::at(sums + L * (u - begin)) = x[u] * by_x + y[u] * by_y + z[u] * by_z;
}

/// Put the loads of pairs of rows from `first` to `last` by sums that begin with unknown `from`.
template <int64_t L>
[[gnu::always_inline]] inline void multiply(const ChangedRows& rows, int64_t first, int64_t last,
                                            int64_t from, double* loads) {
    using Numbers = typename SideBySide<L>::Numbers;
    const int64_t* begin = rows.begin.data();
    const int32_t* offsets = rows.offsets.data();
    const double *values = rows.values.data, *sums = rows.sums.data();
    for (int64_t pair = first; pair < last; ++pair) {
        const double* own = sums + L * (2 * pair - from);
        // Two entries at a time, whose sums do not wait for each other.
        Numbers one{}, other{}, next_one{}, next_other{};
        const auto subtract = [&](int64_t k, Numbers& one, Numbers& other)
                                  __attribute__((always_inline)) {
                                      const Numbers sum = SideBySide<L>::at(own + L * offsets[k]);
                                      one -= sum * SideBySide<L>::at(values + 2 * L * k);
                                      other -= sum * SideBySide<L>::at(values + 2 * L * k + L);
                                  };
        int64_t k = begin[rows.kinds[pair]];
        const int64_t end = begin[rows.kinds[pair] + 1];
        for (; k + 1 < end; k += 2) {
            subtract(k, one, other);
            subtract(k + 1, next_one, next_other);
        }
        if (k < end) subtract(k, one, other);
        SideBySide<L>::at(loads + 2 * L * pair) = one + next_one;
        SideBySide<L>::at(loads + 2 * L * pair + L) = other + next_other;
    }
}

/// Put the loads of the pairs of rows from `low` to `high`, by as many as there is room for sums.
template <int64_t L>
[[gnu::always_inline]] inline void load(const ChangedRows& rows, const Motion& motion, int64_t low,
                                        int64_t high, double* loads) {
    const int64_t at_a_time = rows.room / 2 - rows.reach, n = size(motion.x);
    for (int64_t first = low; first < high; first += at_a_time) {
        const int64_t last = std::min(first + at_a_time, high), from = 2 * first - rows.reach;
        const int64_t begin = std::max<int64_t>(0, from), end = std::min(2 * last + rows.reach, n);
        for (int64_t term = 0; term < rows.weights.rows; ++term)
            add_up<L>(motion, rows.weights[term].data(), begin, end,
                      rows.sums.data() + L * (rows.room * term + begin - from));
        multiply<L>(rows, first, last, from, loads);
    }
}

CATENARY_FOR_TARGETS
void load(const ChangedRows& rows, const Motion& march, int64_t n_lanes, int64_t low, int64_t high,
          double* loads) {
    with_lanes(n_lanes, [&](auto n) __attribute__((always_inline)) {
        load<n>(rows, march, low, high, loads);
    });
}

/// Add the answer to a force in each of L lanes [N], of the unknowns from `begin` on, to motions.
template <int64_t L>
[[gnu::always_inline]] inline void add(const double* forces, const double* answer, int64_t n,
                                       double* x, double* y, double* z, const double* gains) {
    const typename SideBySide<L>::Numbers force = SideBySide<L>::at(forces),
                                          to_x = gains[0] * force, to_y = gains[1] * force,
                                          to_z = gains[2] * force;
    for (int64_t j = 0; j < n; ++j) {
        SideBySide<L>::at(x + L * j) += to_x * answer[j];
        SideBySide<L>::at(y + L * j) += to_y * answer[j];
        SideBySide<L>::at(z + L * j) += to_z * answer[j];
    }
}
CATENARY_FOR_TARGETS
void add_answer(const double* forces, std::span<const double> answer, int64_t begin,
                const Motion& motion, std::span<const double> gains) {
    const int64_t n = size(answer), lanes = motion.spacing;
    const auto of = [&](std::span<double> all) {
        return part(all, begin * lanes, (begin + n) * lanes).data();
    };
    double *x = of(motion.x), *y = of(motion.y), *z = of(motion.z);
    with_lanes(lanes, [&](auto l) __attribute__((always_inline)) {
        add<l>(forces, answer.data(), n, x, y, z, gains.data());
    });
}

}  // namespace

void load(const TangentLanes& lanes, const Motion& march) {
    const int64_t low = lanes.passes->begin() / 2, high = (lanes.passes->end() + 1) / 2;
    load(lanes.rows, march, lanes.n(), low, high, lanes.loads.data());
}

void superpose(const Contacts& contacts, Array2<double> forces, const TangentLanes& lanes) {
    for (int64_t i = 0; i < forces.rows; ++i) {
        if (std::ranges::all_of(forces[i], [](double force) { return force == 0.0; })) continue;
        const auto& [low, high] = contacts.touches[i].filled;
        const auto answer = part(contacts.answers.by_force[i], low, high);
        add_answer(forces[i].data(), answer, low, lanes.motion, contacts.motion_gains);
    }
}

void compensate(const Contacts& contacts, std::span<const int64_t> numbers, Array2<double> forces,
                const TangentLanes& lanes) {
    const auto& [start, at, width, data] = contacts.link_columns;
    for (size_t k = 0; k < numbers.size(); ++k) {
        const int64_t d = numbers[k];
        const auto answer = part(data, at[d], at[d] + width[d]);
        add_answer(forces[k].data(), answer, start[d], lanes.motion, contacts.motion_gains);
    }
}

}  // namespace catenary
