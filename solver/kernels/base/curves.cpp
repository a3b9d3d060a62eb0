// Curves with their derivatives.
#include "base/curves.hpp"

#include <algorithm>
#include <cmath>

namespace catenary {

namespace {

/// Number of the latest place that is not beyond `x`, -1 if all are.
int64_t before(std::span<const double> places, double x) {
    return std::upper_bound(places.begin(), places.end(), x) - places.begin() - 1;
}

/// Number of the polynomial that holds at `x`.
int64_t piece_at(std::span<const double> breaks, double x) {
    return std::min(std::max<int64_t>(before(breaks, x), 0), size(breaks) - 2);
}

/// A cubic by its coefficients, the highest power first.
Derivatives cubic_at(std::span<const double> c, double d) {
    return {((c[0] * d + c[1]) * d + c[2]) * d + c[3], (3.0 * c[0] * d + 2.0 * c[1]) * d + c[2],
            6.0 * c[0] * d + 2.0 * c[1]};
}

}  // namespace

Derivatives spline_at(std::span<const double> breaks, Array2<const double> coefficients, double x) {
    const int64_t i = piece_at(breaks, x);
    return cubic_at(coefficients[i], x - breaks[i]);
}

void tables_at(const SplineTables& tables, double x, std::span<double> values,
               std::span<double> slopes) {
    const int64_t i = piece_at(tables.breaks, x);
    for (int64_t k = 0; k < size(values); ++k)
        std::tie(values[k], slopes[k], std::ignore) =
            cubic_at(tables.coefficients[i][k], x - tables.breaks[i]);
}

Derivatives sines_at(std::span<const double> amplitudes, std::span<const double> rates,
                     std::span<const double> phases, double x) {
    double value = 0.0, first = 0.0, second = 0.0;
    for (int64_t i = 0; i < size(amplitudes); ++i) {
        const double rate = rates[i], angle = rate * x + phases[i];
        const double high = amplitudes[i] * std::sin(angle);
        value += high;
        first += amplitudes[i] * rate * std::cos(angle);
        second -= rate * rate * high;
    }
    return {value, first, second};
}

std::pair<double, double> line_at(std::span<const double> x, std::span<const double> y,
                                  double place) {
    const int64_t i = before(x, place);
    if (i < 0) return {y.front(), 0.0};
    if (i > size(x) - 2) return {y.back(), 0.0};
    const double slope = (y[i + 1] - y[i]) / (x[i + 1] - x[i]);
    return {y[i] + slope * (place - x[i]), slope};
}

void polyline_at(std::span<const double> x, std::span<const double> y,
                 std::span<const double> places, std::span<double> values,
                 std::span<double> slopes) {
    for (int64_t j = 0; j < size(places); ++j)
        std::tie(values[j], slopes[j]) = line_at(x, y, places[j]);
}

}  // namespace catenary
