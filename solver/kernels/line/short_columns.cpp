// Columns cut out.
#include "line/short_columns.hpp"

#include <algorithm>
#include <cmath>

#include "base/targets.hpp"

namespace catenary {

namespace {

/// The largest magnitude.
CATENARY_FOR_TARGETS
double largest_of(std::span<const double> numbers) {
    // Several at once, which do not wait for each other.
    constexpr size_t kAtOnce = 8;
    double largest[kAtOnce] = {};
    const size_t whole = numbers.size() / kAtOnce * kAtOnce;
    for (size_t i = 0; i < whole; i += kAtOnce)
        for (size_t k = 0; k < kAtOnce; ++k) {
            const double magnitude = std::fabs(numbers[i + k]);
            largest[k] = magnitude > largest[k] ? magnitude : largest[k];
        }
    for (size_t i = whole; i < numbers.size(); ++i)
        largest[0] = std::max(largest[0], std::fabs(numbers[i]));
    return *std::max_element(largest, largest + kAtOnce);
}

}  // namespace

double cut_out(Array2<const double> answers, const Cuts& cuts, std::span<double> data) {
    const int64_t n = size(cuts.width), each = n ? answers.rows / n : 0;
    double worst = 0.0;
    for (int64_t i = 0; i < n; ++i)
        for (int64_t k = 0; k < each; ++k) {
            const auto row = answers[i * each + k];
            const int64_t low = std::clamp<int64_t>(cuts.low[i], 0, size(row));
            const int64_t high = std::clamp<int64_t>(cuts.high[i], low, size(row));
            const double leak = std::max(largest_of(row.first(low)), largest_of(row.subspan(high)));
            const double peak = std::max(leak, largest_of(part(row, low, high)));
            if (leak > worst * peak) worst = leak / peak;
            const int64_t width = cuts.width[i], at = cuts.at[i] + k * width;
            std::ranges::copy(part(row, cuts.begin[i], cuts.begin[i] + width),
                              part(data, at, at + width).begin());
        }
    return worst;
}

}  // namespace catenary
