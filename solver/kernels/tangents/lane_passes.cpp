// Free steps of the stations that move in one of several tangents.
#include "tangents/lane_passes.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace catenary {

namespace {

/// Steps from one look at outer stations to the next. The largest motion is found at each of the
/// first so many looks, and then at every so many.
constexpr int64_t kEvery = 8, kPeakEvery = 64;
/// Share of the largest motion below which stations rest, as of windows; round-off is as large.
constexpr double kAtRest = 1e-14;

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
    auto look_at = [&](const Motion& motion, Peak& peak) {
        if (is_peak) find_peak(motion, peak);
        before =
            before || (ends_.begin > 0 && moves(motion, peak, ends_.begin, ends_.begin + guard_));
        behind = behind ||
                 (ends_.end < n_stations() && moves(motion, peak, ends_.end - guard_, ends_.end));
    };
    look_at(parts_.arrays.motion, own_);
    if (march) look_at(*march, of_march_);
    if (before) move(ends_.begin - guard_, ends_.end);
    if (behind) move(ends_.begin, ends_.end + guard_);
}

void LanePasses::step() {
    if (ends_.begin < ends_.end) line_.line.step(line_.work, ends_, n_stations(), *this);
}

void LanePasses::find_peak(const Motion& motion, Peak& peak) const {
    const int64_t lanes = motion.spacing;
    peak.x.assign(lanes, 0.0);
    peak.y.assign(lanes, 0.0);
    for (int64_t u = begin(); u < end(); ++u)
        for (int64_t lane = 0; lane < lanes; ++lane) {
            peak.x[lane] = std::max(peak.x[lane], std::abs(motion.x[u * lanes + lane]));
            peak.y[lane] = std::max(peak.y[lane], std::abs(motion.y[u * lanes + lane]));
        }
}

/// Whether a station from `begin` to `end` moves, or holds NaN.
bool LanePasses::moves(const Motion& motion, const Peak& peak, int64_t begin, int64_t end) const {
    const int64_t lanes = motion.spacing;
    begin = starts_[std::max(begin, ends_.begin)];
    end = starts_[std::min(end, ends_.end)];
    for (int64_t u = begin; u < end; ++u)
        for (int64_t lane = 0; lane < lanes; ++lane)
            if (!(std::abs(motion.x[u * lanes + lane]) <= kAtRest * peak.x[lane] &&
                  std::abs(motion.y[u * lanes + lane]) <= kAtRest * peak.y[lane]))
                return true;
    return false;
}

}  // namespace catenary
