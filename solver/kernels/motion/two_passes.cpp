// Free steps in two passes, and a window that follows the train.
#include "motion/two_passes.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "base/targets.hpp"

namespace catenary {

namespace {

/// The largest motion is found at every so many updates, and at each of the first so many.
constexpr int64_t kPeakEvery = 64;
/// Shares of the parts of a window behind the train and ahead in which motion fades.
constexpr double kBehind = 0.85, kAhead = 0.6;

/// The first number that is not below x, and the first that is above.
int64_t not_below(std::span<const double> ascending, double x) {
    return std::lower_bound(ascending.begin(), ascending.end(), x) - ascending.begin();
}
int64_t above(std::span<const double> ascending, double x) {
    return std::upper_bound(ascending.begin(), ascending.end(), x) - ascending.begin();
}

/// Span in which a place [m] is, as a number with a fraction.
double span_of(std::span<const double> masts, double x) {
    const int64_t i = std::clamp<int64_t>(above(masts, x) - 1, 0, size(masts) - 2);
    return i + (x - masts[i]) / (masts[i + 1] - masts[i]);
}
/// Place [m] of a number with a fraction of spans; beyond the line if there are not as many.
double place_of_span(std::span<const double> masts, double number) {
    const int64_t i =
        std::clamp<int64_t>(static_cast<int64_t>(std::floor(number)), 0, size(masts) - 2);
    return masts[i] + (number - i) * (masts[i + 1] - masts[i]);
}

/// Whether any of the stations from `begin` to `end` that are in the window moves.
bool moves(const Window& window, const Motion& motion, int64_t begin, int64_t end) {
    begin = std::max(begin, window.at().low);
    end = std::max(begin, std::min(end, window.at().high));
    return moves(motion, window.starts[begin], window.starts[end], window.peak, window.by_motion);
}

struct Range {
    int64_t begin, end;
};

/// Stations that move, at least the range `least`.
Range follow_motion(const Window& window, const Motion& motion, Range least) {
    const int64_t guard = window.guard;
    int64_t low = window.at().low, high = window.at().high;
    if (moves(window, motion, low, low + guard)) {
        low = std::max<int64_t>(0, low - guard);
    } else {
        while (low + guard <= least.begin && !moves(window, motion, low + guard, low + 2 * guard))
            low += guard;
    }
    if (moves(window, motion, high - guard, high)) {
        high = std::min(window.n_stations(), high + guard);
    } else {
        while (high - guard >= least.end && !moves(window, motion, high - 2 * guard, high - guard))
            high -= guard;
    }
    return {std::min(low, least.begin), std::max(high, least.end)};
}

/// Bring the stations from `begin` to `end` to rest.
void rest(const Window& window, const Motion& motion, int64_t begin, int64_t end) {
    for (int64_t i = window.starts[begin]; i < window.starts[std::max(begin, end)]; ++i) {
        motion.x[i] = window.is_exact ? 0.0 : displacement_at(i, motion) / motion.shares[0];
        motion.y[i] = motion.z[i] = 0.0;
        if (!window.known.empty()) window.known[i] = 0.0;
    }
}

/// Move the window to the stations from `begin` to `end`; stations that leave it come to rest.
void move(const Window& window, const Motion& motion, int64_t begin, int64_t end) {
    const Ends before = window.at();
    rest(window, motion, before.low, std::min(begin, before.high));
    rest(window, motion, std::max(end, before.low), before.high);
    turn_to(window, begin, end);
}

/// Damping at a share `into` of the way into the fading part, in terms of its scale: it grows as
/// the transmission-free absorbing potential (D. E. Manolopoulos, J. Chem. Phys. 117, 2002), as far
/// as that is finite.
double damping(double into) {
    constexpr double c = 2.62206, taken = 0.98;
    constexpr double a = 1.0 - 16.0 / (c * c * c), b = (1.0 - 17.0 / (c * c * c)) / (c * c);
    const double x = taken * c * into;
    return a * x - b * x * x * x + 4.0 / ((c - x) * (c - x)) - 4.0 / ((c + x) * (c + x));
}

/// Reduce the velocity of a station, by the part `decay` if that is little; its place stays.
void slow_down(const Window& window, const Motion& motion, int64_t station, double decay) {
    const double loss = decay / (1.0 + decay);
    const auto& shares = motion.shares;
    for (int64_t i = window.starts[station]; i < window.starts[station + 1]; ++i) {
        const double change = -loss * velocity_at(i, motion);
        motion.y[i] += change;
        motion.x[i] -= shares[1] / shares[0] * change;
    }
}

/// Slow down the outer parts of the window behind the place `first` and ahead of `last` [m].
///
/// Waves whose group velocity is nearly the train's stay there for long. In its frame their
/// envelope obeys Schroedinger's equation, i a_t = -D / 2 a_xx, and damping that begins at once
/// sends them back, however little it is: so it grows, as slowly as the length allows.
void fade(const Window& window, const Motion& motion, double first, double last) {
    const int64_t begin = window.at().low, end = window.at().high;
    const auto &low = window.low, &high = window.high;
    const double behind = kBehind * (first - low[begin]), ahead = kAhead * (high[end - 1] - last);
    for (int64_t i = begin; begin > 0 && i < end && high[i] < low[begin] + behind; ++i) {
        const double into = 1.0 - (high[i] - low[begin]) / behind;
        slow_down(window, motion, i, window.fading / (behind * behind) * damping(into));
    }
    for (int64_t i = end - 1;
         end < window.n_stations() && i >= begin && low[i] > high[end - 1] - ahead; --i) {
        const double into = 1.0 - (high[end - 1] - low[i]) / ahead;
        slow_down(window, motion, i, window.fading / (ahead * ahead) * damping(into));
    }
}

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

bool update(const Window& window, const Motion& motion) {
    auto& state = *reinterpret_cast<WindowState*>(window.state.data());
    const int64_t step = state.step++;
    if (step % window.every) return false;
    const bool is_fresh = state.is_fresh != 0;
    state.is_fresh = 0;
    double first = window.loaded[0], last = window.loaded[1];
    for (double contact : window.contacts) {
        first = std::min(first, contact);
        last = std::max(last, contact);
    }
    Range range{not_below(window.high, first - window.margin),
                above(window.low, last + window.margin)};
    if (window.by_motion > 0.0) {
        const int64_t updates = step / window.every;
        if (is_fresh || updates < kPeakEvery || updates % kPeakEvery == 0)
            find_peak(motion, window.starts[window.at().low], window.starts[window.at().high],
                      window.peak);
        range = follow_motion(window, motion, range);
    } else {
        const auto& masts = window.masts;
        const double behind = place_of_span(masts, span_of(masts, first) - window.spans_behind),
                     ahead = place_of_span(masts, span_of(masts, last) + window.spans_ahead);
        range.begin = std::min(range.begin, not_below(window.high, behind));
        range.end = std::max(range.end, above(window.low, ahead));
    }
    const int64_t end =
        std::min(window.n_stations(), std::max(range.end, range.begin + kLeastStations));
    const int64_t begin = std::max<int64_t>(0, std::min(range.begin, end - kLeastStations));
    move(window, motion, begin, end);
    if (window.fading > 0.0) fade(window, motion, first, last);
    return is_fresh;
}

void turn_to(const Window& window, int64_t begin, int64_t end) {
    Ends& ends = window.at();
    const int64_t middle = middle_of(begin, end), n = window.n_stations();
    turn(window.kinds, window.turning, ends.middle, middle);
    // The station beyond takes its part in a step, but is then left as it was: so ends are stable
    // at any time step.
    ends = {std::max<int64_t>(0, begin - 1), std::min(n, end + 1), begin, end, middle};
    // A link that switches moves stations within the window only; links at its ends do not switch.
    const int64_t inner = begin > 0 ? std::min(begin + window.guard, n) : begin,
                  outer = end < n ? std::max(end - window.guard, inner) : end;
    const int64_t first = window.links_before[inner], last = window.links_before[outer];
    window.links[0] = first;
    window.links[1] = last;
    // The pass back finds the reserves of all links at its end.
    std::ranges::fill(window.ranges.all(), first);
    window.ranges(1, 1) = last;
}

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
    tracked_.behind(n_followed_++, [this](int64_t begin, int64_t end) {
        reserves_within(parts_.arrays.motion, tracked_.links, begin, end, tracked_.reserve);
    });
}

}  // namespace catenary
