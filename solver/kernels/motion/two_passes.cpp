// Free steps in two passes.
#include "motion/two_passes.hpp"

#include <algorithm>
#include <stdexcept>

#include "base/targets.hpp"

namespace catenary {

namespace {

/// The numbers, or null if there are none.
template <class T>
T* in(std::span<T> numbers) {
    return numbers.empty() ? nullptr : numbers.data();
}

std::vector<std::unique_ptr<Kernels>> kernels_for(const PassParts& parts, int scenes) {
    std::vector<std::unique_ptr<Kernels>> kernels;
    for (const auto& [rows, factors] : parts.layouts)
        kernels.push_back(scenes == 1 ? kernels_of(rows, factors)
                                      : kernels_for_scenes(rows, factors, scenes));
    return kernels;
}

CATENARY_FOR_TARGETS
void add_up(std::span<double> result, const double* velocity, const double* latest,
            const double* known, const std::array<double, 2>& shares) {
    const double of_latest = shares[0], of_known = shares[1];
    for (size_t i = 0; i < result.size(); ++i)
        result[i] = velocity[i] + of_latest * latest[i] + of_known * known[i];
}

}  // namespace

PassLine::PassLine(const PassParts& parts, int scenes)
    : line(kernels_for(parts, scenes), parts.station_types, scenes) {
    const PassArrays& arrays = parts.arrays;
    const Motion& m = arrays.motion;
    const int64_t n = size(parts.factors.kinds), low = parts.factors.low;
    if (low < 0 || low > n || m.spacing != scenes)
        throw std::invalid_argument("a line has other stations or scenes than its steps");
    std::vector<Layout> rows, factors;
    for (const auto& [of_rows, of_factors] : parts.layouts) {
        rows.push_back(of_rows);
        factors.push_back(of_factors);
    }
    work.product = parts.rows.product(rows);
    work.product.factor = in(arrays.factor);
    work.product.velocity = in(arrays.velocity);
    work.factored = parts.factors.factored(factors);
    work.loads = in(arrays.loads);
    work.answer = in(arrays.answer);
    work.motion = {in(m.x), in(m.y), in(m.z), in(arrays.known), parts.changes};
    line.set_runs(work, n, low);
    auto holds = [](auto numbers, int64_t most) {
        return numbers.empty() || size(numbers) >= most;
    };
    const Ends& ends = parts.factors.at();
    if (size(parts.rows.kinds) < n || ends.begin < 0 || ends.low < ends.begin ||
        ends.high < ends.low || ends.end < ends.high || n < ends.end)
        throw std::invalid_argument("a line has rows of other stations than factors");
    const int64_t own = line.start_of(work, ends.high) - line.start_of(work, ends.low);
    if (size(arrays.factor) < line.n_read() || !holds(arrays.velocity, line.n_read()) ||
        size(arrays.answer) < line.n_solved() || !holds(arrays.loads, line.n_solved()) ||
        size(m.x) < own || !holds(arrays.known, own))
        throw std::invalid_argument("arrays of a line have fewer numbers than its stations");
    if (scenes == 1) return;
    even = line.even_rows(work, n);
    work.product.even = even.data();
}

TwoPasses::TwoPasses(PassParts parts) : parts_(std::move(parts)), line_(parts_) {}

void TwoPasses::step() {
    line_.line.step(line_.work, parts_.factors.at(), std::max<int64_t>(1, tracked_.stretch), *this);
}

void TwoPasses::predict_velocities(int64_t begin, int64_t end) {
    const PassArrays& arrays = parts_.arrays;
    end = std::min(end, size(arrays.predicted));
    if (begin >= end) return;
    add_up(part(arrays.predicted, begin, end), &arrays.motion.y[begin], &arrays.motion.z[begin],
           &arrays.known[begin], parts_.changes.velocity);
}

void TwoPasses::before() {
    const Motion& motion = parts_.arrays.motion;
    n_followed_ = 0;
    int64_t begin = 0, end = size(motion.x);
    if (window_) {
        if (update(*window_, motion)) reserves(motion, tracked_.links, tracked_.reserve);
        begin = window_->starts[window_->at().low];
        end = window_->starts[window_->at().high];
    }
    predict_velocities(begin, end);
}

void TwoPasses::after_stretch() {
    const auto [links, reserve, ranges, stretch] = tracked_;
    const Motion& motion = parts_.arrays.motion;
    part(ranges.all(), 2 * n_followed_, 2 * n_followed_ + 4);
    const auto before = ranges[n_followed_], now = ranges[n_followed_ + 1];
    ++n_followed_;
    reserves_within(motion, links, now[0], before[0], reserve);
    reserves_within(motion, links, before[1], now[1], reserve);
}

}  // namespace catenary
