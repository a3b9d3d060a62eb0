// Free steps of the stations that move in one of several tangents.
#include "tangents/lane_passes.hpp"

#include <algorithm>
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

}  // namespace catenary
