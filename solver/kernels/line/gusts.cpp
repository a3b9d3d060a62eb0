// Gusts between posts, and their waves.
#include "line/gusts.hpp"

#include <cmath>

#include "base/targets.hpp"

namespace catenary {

void bridge(std::span<const double> first, std::span<const double> last,
            std::span<const double> rates, std::span<const double> steps,
            Array2<const double> normals, Array2<double> out) {
    double left = 0.0;
    for (const double step : steps) left += step;
    for (int64_t j = 0; j < out.rows; ++j) {
        left -= steps[j];
        const auto before = j == 0 ? first : std::span<const double>(out[j - 1]);
        for (int64_t i = 0; i < out.columns; ++i) {
            const double near = std::exp(-rates[i] * steps[j]), far = std::exp(-rates[i] * left);
            const double lost_near = -std::expm1(-2.0 * rates[i] * steps[j]);
            const double lost_far = -std::expm1(-2.0 * rates[i] * left);
            const double lost = -std::expm1(-2.0 * rates[i] * (steps[j] + left));
            const double mean = (near * lost_far * before[i] + far * lost_near * last[i]) / lost;
            out(j, i) = mean + std::sqrt(lost_near * lost_far / lost) * normals(j, i);
        }
    }
}

CATENARY_FOR_TARGETS
void add_waves(Array2<const double> waves, Array2<const double> amplitudes, Array2<double> out) {
    for (int64_t i = 0; i < waves.rows; ++i) {
        const auto result = out[i];
        for (int64_t j = 0; j < waves.columns; ++j) {
            const double factor = waves(i, j);
            const auto amplitude = amplitudes[j];
            for (size_t p = 0; p < result.size(); ++p) result[p] += factor * amplitude[p];
        }
    }
}

}  // namespace catenary
