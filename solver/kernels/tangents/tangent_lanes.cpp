// Loops over motions of the line side by side.
#include "tangents/tangent_lanes.hpp"

#include <algorithm>

#include "base/targets.hpp"
#include "contact/columns.hpp"

namespace catenary {

namespace {

/// Numbers of an unknown in L lanes, and as they stand in memory.
template <int64_t L>
struct Wide {
    typedef double Numbers __attribute__((vector_size(8 * L)));
    typedef double InMemory __attribute__((vector_size(8 * L), aligned(8), may_alias));
    static InMemory& at(double* numbers) { return *reinterpret_cast<InMemory*>(numbers); }
    static const InMemory& at(const double* numbers) {
        return *reinterpret_cast<const InMemory*>(numbers);
    }
};
template <>
struct Wide<1> {
    using Numbers = double;
    static double& at(double* numbers) { return *numbers; }
    static double at(const double* numbers) { return *numbers; }
};
using Scenes = Wide<kScenes>;

/// Fill in the sums with the same weights, of n unknowns that `unknown` gives the numbers of.
template <int64_t L, class Unknown>
[[gnu::always_inline]] inline void add_up(const LineMotion& motion, const double* weights,
                                          int64_t n, Unknown unknown, double* sums) {
    const typename Wide<L>::Numbers by_d = Wide<L>::at(weights), by_v = Wide<L>::at(weights + L),
                                    by_a = Wide<L>::at(weights + 2 * L);
    const double *d = motion.displacement.data(), *v = motion.velocity.data(),
                 *a = motion.acceleration.data();
    for (int64_t i = 0; i < n; ++i) {
        const int64_t u = unknown(i);
        Wide<L>::at(sums + L * i) = d[u] * by_d + v[u] * by_v + a[u] * by_a;
    }
}

/// Put the loads of pairs of rows from `first` to `last`.
template <int64_t L>
[[gnu::always_inline]] inline void multiply(const ChangedRows& rows, int64_t first, int64_t last,
                                            double* loads) {
    const int64_t* begin = rows.begin.data();
    const int32_t* offsets = rows.offsets.data();
    const double *values = rows.values.data, *sums = rows.sums.numbers.data();
    for (int64_t pair = first; pair < last; ++pair) {
        const int64_t kind = rows.kinds[pair], end = begin[kind + 1];
        typename Wide<L>::Numbers one{}, other{};
        for (int64_t k = begin[kind]; k < end; ++k) {
            const typename Wide<L>::Numbers sum = Wide<L>::at(sums + L * (2 * pair + offsets[k]));
            one -= sum * Wide<L>::at(values + 2 * L * k);
            other -= sum * Wide<L>::at(values + 2 * L * k + L);
        }
        Wide<L>::at(loads + 2 * L * pair) = one;
        Wide<L>::at(loads + 2 * L * pair + L) = other;
    }
}

/// Pairs of rows that are taken at a time, so that their sums are still near the processor.
constexpr int64_t kPairsAtATime = 64;

template <int64_t L>
[[gnu::always_inline]] inline void load(const ChangedRows& rows, const LineMotion& motion,
                                        double* loads) {
    const auto& [weights, begin, unknowns, numbers] = rows.sums;
    const int64_t n = size(motion.displacement), n_pairs = size(rows.kinds);
    for (int64_t i = 1; i < weights.rows; ++i)
        add_up<L>(
            motion, weights[i].data(), begin[i] - begin[i - 1],
            [from = &unknowns[begin[i - 1]]](int64_t k) { return from[k]; },
            numbers.data() + L * (n + begin[i - 1]));
    int64_t ready = 0;
    for (int64_t first = 0; first < n_pairs; first += kPairsAtATime) {
        const int64_t last = std::min(first + kPairsAtATime, n_pairs);
        const int64_t until = std::min(2 * last + rows.ahead, n);
        add_up<L>(
            motion, weights[0].data(), until - ready, [ready](int64_t k) { return ready + k; },
            numbers.data() + L * ready);
        ready = until;
        multiply<L>(rows, first, last, loads);
    }
}
CATENARY_FOR_TARGETS
void load_one(const ChangedRows& rows, const LineMotion& motion, double* loads) {
    load<1>(rows, motion, loads);
}
CATENARY_FOR_TARGETS
void load_scenes(const ChangedRows& rows, const LineMotion& motion, double* loads) {
    load<kScenes>(rows, motion, loads);
}

/// Add the answer to a force in each scene to motions.
CATENARY_FOR_TARGETS
void add_to_scenes(const double* forces, const double* answer, int64_t n, double* x, double* y,
                   double* z, const double* gains) {
    const Scenes::Numbers force = Scenes::at(forces), to_x = gains[0] * force,
                          to_y = gains[1] * force, to_z = gains[2] * force;
    for (int64_t j = 0; j < n; ++j) {
        Scenes::at(x + kScenes * j) += to_x * answer[j];
        Scenes::at(y + kScenes * j) += to_y * answer[j];
        Scenes::at(z + kScenes * j) += to_z * answer[j];
    }
}

/// Add the answer to a force in each lane [N], of the unknowns from `begin` on, to the motions.
void add_answer(const double* forces, std::span<const double> answer, int64_t begin,
                const Motion& motion, std::span<const double> gains) {
    if (motion.spacing == 1) {
        catenary::add_answer(forces[0], answer, begin, motion, gains);
        return;
    }
    const int64_t n = size(answer);
    const auto of = [&](std::span<double> all) {
        return part(all, begin * kScenes, (begin + n) * kScenes).data();
    };
    add_to_scenes(forces, answer.data(), n, of(motion.x), of(motion.y), of(motion.z), gains.data());
}

}  // namespace

void take_free_step(const TangentLanes& lanes) {
    if (lanes.alone)
        lanes.alone->step();
    else
        lanes.together->step();
}

void load(const TangentLanes& lanes, const LineMotion& motion) {
    (lanes.n() == 1 ? load_one : load_scenes)(lanes.rows, motion, lanes.loads.data());
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
