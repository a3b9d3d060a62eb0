// Free steps in two passes.
#include "motion/two_passes.hpp"

#include <algorithm>

#include "base/targets.hpp"

namespace catenary {

namespace {

double* in(std::span<double> numbers) {
    return numbers.empty() ? nullptr : numbers.data();
}

CATENARY_FOR_TARGETS
void add_up(std::span<double> result, const double* velocity, const double* latest,
            const double* known, const std::array<double, 2>& shares) {
    const double of_latest = shares[0], of_known = shares[1];
    for (size_t i = 0; i < result.size(); ++i)
        result[i] = velocity[i] + of_latest * latest[i] + of_known * known[i];
}

}  // namespace

TwoPasses::TwoPasses(Line line, const ProductArrays& rows, const FactorArrays& factors,
                     const PassArrays& arrays, const Changes& changes)
    : line_(std::move(line)), factors_(factors), arrays_(arrays), changes_(changes) {
    work_.product = rows.product();
    work_.product.factor = in(arrays.factor);
    work_.product.velocity = in(arrays.velocity);
    work_.factored = factors.factored();
    work_.loads = arrays.loads.empty() ? nullptr : arrays.loads.data();
    work_.answer = in(arrays.answer);
    const Motion& m = arrays.motion;
    work_.motion = {in(m.x), in(m.y), in(m.z), in(arrays.known), changes};
    line_.set_runs(work_, size(factors.kinds), factors.low);
}

void TwoPasses::track(const Links& links, std::span<double> reserve, Array2<const int64_t> ranges,
                      int64_t stretch) {
    links_ = links;
    reserve_ = reserve;
    ranges_ = ranges;
    stretch_ = std::max<int64_t>(1, stretch);
}

void TwoPasses::step() {
    line_.step(work_, factors_.at(), stretch_, *this);
}

void TwoPasses::predict_velocities(int64_t begin, int64_t end) {
    end = std::min(end, size(arrays_.predicted));
    if (begin >= end) return;
    add_up(part(arrays_.predicted, begin, end), &arrays_.motion.y[begin], &arrays_.motion.z[begin],
           &arrays_.known[begin], changes_.velocity);
}

void TwoPasses::before() {
    n_followed_ = 0;
    int64_t begin = 0, end = size(arrays_.motion.x);
    if (window_) {
        if (look(*window_, arrays_.motion))
            reserves_within(arrays_.motion, links_, 0, size(reserve_), reserve_);
        begin = window_->starts[window_->at().begin];
        end = window_->starts[window_->at().end];
    }
    predict_velocities(begin, end);
}

void TwoPasses::after_stretch() {
    const auto before = ranges_[n_followed_], now = ranges_[n_followed_ + 1];
    ++n_followed_;
    reserves_within(arrays_.motion, links_, now[0], before[0], reserve_);
    reserves_within(arrays_.motion, links_, before[1], now[1], reserve_);
}

void left_behind(std::span<const int64_t> starts, int64_t stretch, Array2<const int64_t> unknowns,
                 Array2<int64_t> ranges) {
    const int64_t n = unknowns.rows, own = size(starts) - 1, middle = own / 2;
    const int64_t pairs = (own - 1) / 2;
    auto is_within = [&](int64_t link, int64_t begin, int64_t end) {
        const auto [least, most] = std::ranges::minmax(unknowns[link]);
        return begin <= least && most < end;
    };
    int64_t first = 0;
    while (first < n && unknowns(first, 0) < starts[middle]) ++first;
    int64_t last = first;
    ranges(0, 0) = ranges(0, 1) = first;
    for (int64_t number = 1; number < ranges.rows; ++number) {
        const int64_t reach = std::min(number * stretch, pairs);
        int64_t begin = starts[middle - reach], end = starts[middle + reach + 1];
        if (number == ranges.rows - 1) {
            begin = 0;
            end = starts[own];
        }
        while (first > 0 && is_within(first - 1, begin, end)) --first;
        while (last < n && is_within(last, begin, end)) ++last;
        ranges(number, 0) = first;
        ranges(number, 1) = last;
    }
}

}  // namespace catenary
