// Loads in time, evaluated; gusts between posts, and their waves.
#include "loads/loads.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "base/targets.hpp"

namespace catenary {

namespace {

/// A function of time of this kind.
double value_at(double time, int64_t kind, std::span<const double> numbers) {
    if (kind == kConstant) return numbers[0];
    if (kind == kTable) {
        const size_t n = numbers.size() / 2;
        const auto times = numbers.first(n), values = numbers.subspan(n);
        if (time <= times[0]) return values[0];
        if (time >= times[n - 1]) return values[n - 1];
        const auto i = std::lower_bound(times.begin(), times.end(), time) - times.begin();
        const double share = (time - times[i - 1]) / (times[i] - times[i - 1]);
        return (1.0 - share) * values[i - 1] + share * values[i];
    }
    double total = numbers[0];
    for (size_t i = 1; i + 2 < numbers.size(); i += 3) {
        const double frequency = numbers[i], amplitude = numbers[i + 1], phase = numbers[i + 2];
        total += amplitude * std::cos(frequency * time + phase);
    }
    return total;
}

/// Fill in the forces that change by factors.
void put_changing(double time, const Changing& changing, std::span<const double> constant,
                  std::span<double> values) {
    for (Factor& factor : changing.factors)
        factor.value =
            value_at(time, factor.kind, part(changing.numbers, factor.begin, factor.end));
    for (int64_t j = 0; j < size(changing.places); ++j) {
        const int64_t place = changing.places[j];
        double total = constant[place];
        for (int64_t e = changing.begins[j]; e < changing.begins[j + 1]; ++e)
            total += changing.factors[changing.terms[e]].value * changing.forces[e];
        values[place] = total;
    }
}

/// Add loads that are linear in time between slices.
void add_samples(double time, const Sampled& sampled, std::span<double> values) {
    for (const SampledLoad& load : sampled.loads) {
        const int64_t n = load.last - load.first;
        const auto places = sampled.places.subspan(load.first, n);
        const auto times = sampled.times.subspan(load.times, load.held);
        const int64_t after = std::upper_bound(times.begin(), times.end(), time) - times.begin();
        const int64_t i = std::max<int64_t>(0, after - 1);
        const auto here = sampled.samples.subspan(load.samples + i * n, n);
        if (i + 1 == load.held || times[i] >= time) {
            for (int64_t j = 0; j < n; ++j) values[places[j]] += here[j];
            continue;
        }
        const auto then = sampled.samples.subspan(load.samples + (i + 1) * n, n);
        const double share = (time - times[i]) / (times[i + 1] - times[i]);
        for (int64_t j = 0; j < n; ++j)
            values[places[j]] += (1.0 - share) * here[j] + share * then[j];
    }
}

}  // namespace

void evaluate(const Loads& loads) {
    const double time = loads.clock[0];
    if (!std::isfinite(time)) throw std::invalid_argument("the time of loads is no number");
    put_changing(time, loads.changing, loads.constant, loads.values);
    add_samples(time, loads.sampled, loads.values);
    remember(time, loads.values, loads.memories);
}

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
