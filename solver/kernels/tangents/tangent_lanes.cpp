// Free steps of the stations that move in one of several tangents, and their loads.
#include "tangents/tangent_lanes.hpp"

#include <algorithm>
#include <stdexcept>

#include "base/targets.hpp"

namespace catenary {

namespace {

/// Steps from one look at outer stations to the next. The largest motion is found at each of the
/// first so many looks, and then at every so many.
constexpr int64_t kEvery = 8, kPeakEvery = 64;
/// Share of the largest motion below which stations rest, as of windows; round-off is as large.
constexpr double kAtRest = 1e-14;

/// Sums of the march's motion with weights.
template <int64_t L>
struct Sums {
    using Numbers = typename SideBySide<L>::Numbers;
    Numbers by_x, by_y, by_z;
    const double *x, *y, *z;

    [[gnu::always_inline]] Sums(const double* weights, const Motion& march)
        : by_x(SideBySide<L>::at(weights)),
          by_y(SideBySide<L>::at(weights + L)),
          by_z(SideBySide<L>::at(weights + 2 * L)),
          x(march.x.data()),
          y(march.y.data()),
          z(march.z.data()) {}
    [[gnu::always_inline]] Numbers at(int64_t u) const {
        return by_x * x[u] + by_y * y[u] + by_z * z[u];
    }
};

/// The sums of a term at a node of a wire and at the one before, in registers.
template <int64_t L>
struct Walk {
    using Numbers = typename SideBySide<L>::Numbers;
    int64_t term = -1, before = -1, here = -1;  ///< first unknowns
    Numbers w0{}, r0{}, w1{}, r1{};

    /// Go to the first node of a run, which most runs begin at where the one before ended.
    [[gnu::always_inline]] void begin(const ChangedRows::Run& run, const Sums<L>& sums) {
        if (run.term == term && 2 * run.before == before && 2 * run.first == here) return;
        term = run.term, before = 2 * run.before, here = 2 * run.first;
        w0 = sums.at(before), r0 = sums.at(before + 1);
        w1 = sums.at(here), r1 = sums.at(here + 1);
    }
    /// Go to the next node, where the sums are w2 and r2.
    [[gnu::always_inline]] void go_on(int64_t next, const Numbers& w2, const Numbers& r2) {
        before = here, here = next;
        w0 = w1, r0 = r1, w1 = w2, r1 = r2;
    }
};

/// Put minus the products of the nodes of a run, or add them; its numbers stay in registers.
template <int64_t L, bool Adds>
[[gnu::always_inline]] inline void multiply(const ChangedRows::Run& run, const double* numbers,
                                            const Sums<L>& sums, Walk<L>& walk, double* loads) {
    using Numbers = typename SideBySide<L>::Numbers;
    const Numbers own = SideBySide<L>::at(numbers), level = SideBySide<L>::at(numbers + L),
                  turned = SideBySide<L>::at(numbers + 2 * L),
                  own_turned = SideBySide<L>::at(numbers + 3 * L),
                  sloping = SideBySide<L>::at(numbers + 4 * L),
                  bent = SideBySide<L>::at(numbers + 5 * L);
    walk.begin(run, sums);
    const auto pass = [&](int64_t next) __attribute__((always_inline)) {
        const auto& [_, before, here, w0, r0, w1, r1] = walk;
        const Numbers w2 = sums.at(next), r2 = sums.at(next + 1);
        Numbers one = own * w1, other = own_turned * r1;
        double* to = loads + L * here;
        if (Adds) one += SideBySide<L>::at(to), other += SideBySide<L>::at(to + L);
        SideBySide<L>::at(to) = one + level * (w0 + w2) + turned * (r2 - r0);
        SideBySide<L>::at(to + L) = other + sloping * (w2 - w0) + bent * (r0 + r2);
        walk.go_on(next, w2, r2);
    };
    for (int64_t k = 1; k < run.n; ++k) pass(walk.here + 2 * run.step);
    pass(2 * run.after);
}

/// The same of a node between different elements.
template <int64_t L, bool Adds>
[[gnu::always_inline]] inline void multiply_uneven(const ChangedRows::Run& run,
                                                   const double* numbers, const Sums<L>& sums,
                                                   Walk<L>& walk, double* loads) {
    using Numbers = typename SideBySide<L>::Numbers;
    walk.begin(run, sums);
    const auto& [_, before, here, w0, r0, w1, r1] = walk;
    const Numbers w2 = sums.at(2 * run.after), r2 = sums.at(2 * run.after + 1);
    for (double* to = loads + L * here; to < loads + L * (here + 2); to += L) {
        Numbers load =
            SideBySide<L>::at(numbers) * w0 + SideBySide<L>::at(numbers + L) * r0 +
            SideBySide<L>::at(numbers + 2 * L) * w1 + SideBySide<L>::at(numbers + 3 * L) * r1 +
            SideBySide<L>::at(numbers + 4 * L) * w2 + SideBySide<L>::at(numbers + 5 * L) * r2;
        if (Adds) load += SideBySide<L>::at(to);
        SideBySide<L>::at(to) = load;
        numbers += 6 * L;
    }
    walk.go_on(2 * run.after, w2, r2);
}

/// Subtract the products of a row's further entries.
template <int64_t L>
[[gnu::always_inline]] inline void multiply_further(const ChangedRows& rows, int64_t row,
                                                    int64_t kind, const Motion& march,
                                                    double* loads) {
    const double *x = march.x.data() + row, *y = march.y.data() + row, *z = march.z.data() + row;
    typename SideBySide<L>::Numbers sum = SideBySide<L>::at(loads + L * row);
    for (int64_t k = rows.begin[kind]; k < rows.begin[kind + 1]; ++k) {
        const int64_t ahead = rows.ahead[k];
        const double* numbers = rows.further[k].data();
        sum -= SideBySide<L>::at(numbers) * x[ahead] + SideBySide<L>::at(numbers + L) * y[ahead] +
               SideBySide<L>::at(numbers + 2 * L) * z[ahead];
    }
    SideBySide<L>::at(loads + L * row) = sum;
}

CATENARY_FOR_TARGETS
void load(const ChangedRows& rows, const Motion& march, int64_t n_lanes, int64_t first, int64_t end,
          double* loads) {
    with_lanes(n_lanes, [&](auto n) __attribute__((always_inline)) {
        for (int64_t part = first; part < end; ++part) {
            Walk<n> walk;
            for (int64_t r = rows.parts(part, 0); r < rows.parts(part + 1, 0); ++r) {
                const auto& run = *reinterpret_cast<const ChangedRows::Run*>(rows.runs[r].data());
                if (run.numbers < 0) {
                    std::fill_n(loads + 2 * n * run.first, 2 * n, 0.0);
                    continue;
                }
                const Sums<n> sums(rows.weights[run.term].data(), march);
                const double* numbers = rows.numbers[run.numbers].data();
                const auto take = [&](auto adds) __attribute__((always_inline)) {
                    if (run.is_even)
                        multiply<n, adds>(run, numbers, sums, walk, loads);
                    else
                        multiply_uneven<n, adds>(run, numbers, sums, walk, loads);
                };
                run.term == 0 ? take(std::false_type{}) : take(std::true_type{});
            }
            for (int64_t r = rows.parts(part, 1); r < rows.parts(part + 1, 1); ++r)
                multiply_further<n>(rows, rows.rows(r, 0), rows.rows(r, 1), march, loads);
        }
    });
}

}  // namespace

LanePasses::LanePasses(PassParts parts, int64_t guard)
    : parts_(std::move(parts)),
      line_(parts_, static_cast<int>(parts_.arrays.motion.spacing)),
      guard_(guard),
      ends_(parts_.factors.at()) {
    const int64_t n = size(parts_.factors.kinds), lanes = parts_.arrays.motion.spacing;
    if (ends_.begin != 0 || ends_.low != 0 || ends_.high != n || ends_.end != n)
        throw std::invalid_argument("tangents have a part of a line only");
    for (int64_t station = 0; station <= n; ++station)
        starts_.push_back(line_.line.start_of(line_.work, station) / lanes);
    middle_ = ends_.middle;
    if (guard_ > 0) ends_.begin = ends_.end = 0;
}

void LanePasses::wake(int64_t begin, int64_t end) {
    if (begin >= end) return;
    const auto first = std::ranges::upper_bound(starts_, begin) - 1,
               last = std::ranges::lower_bound(starts_, end);
    move(first - starts_.begin(), last - starts_.begin());
}

void LanePasses::move(int64_t begin, int64_t end) {
    if (ends_.begin < ends_.end) {
        begin = std::min(begin, ends_.begin);
        end = std::max(end, ends_.end);
    }
    begin = std::max<int64_t>(0, begin);
    end = std::min(n_stations(), end);
    ends_ = {begin, end, begin, end, std::clamp(middle_, begin, end - 1)};
}

void LanePasses::follow(const Motion* march) {
    const int64_t look = n_followed_++;
    if (look % kEvery != 0 || (ends_.begin == 0 && ends_.end == n_stations())) return;
    const bool is_peak = look < kEvery * kPeakEvery || look % (kEvery * kPeakEvery) == 0;
    bool before = false, behind = false;
    const int64_t first = std::min(ends_.begin + guard_, ends_.end),
                  last = std::max(ends_.end - guard_, ends_.begin);
    auto look_at = [&](const Motion& motion, std::vector<double>& peak) {
        peak.resize(2 * motion.spacing);
        if (is_peak) find_peak(motion, begin(), end(), peak);
        before =
            before || (ends_.begin > 0 && moves(motion, begin(), starts_[first], peak, kAtRest));
        behind = behind ||
                 (ends_.end < n_stations() && moves(motion, starts_[last], end(), peak, kAtRest));
    };
    look_at(parts_.arrays.motion, own_);
    if (march) look_at(*march, of_march_);
    if (before) move(ends_.begin - guard_, ends_.end);
    if (behind) move(ends_.begin, ends_.end + guard_);
}

void LanePasses::step() {
    if (ends_.begin < ends_.end) line_.line.step(line_.work, ends_, n_stations(), *this);
}

void load(const TangentLanes& lanes, const Motion& march) {
    const int64_t each = 2 * lanes.rows.part;  // unknowns
    load(lanes.rows, march, lanes.n(), lanes.passes->begin() / each,
         (lanes.passes->end() + each - 1) / each, lanes.loads.data());
}

}  // namespace catenary
