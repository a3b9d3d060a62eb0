#pragma once
// Curves with their derivatives: splines, sums of sines, polylines. Splines are extrapolated beyond
// their ends.
#include <tuple>
#include <utility>

#include "base/arrays.hpp"

namespace catenary {

/// A value with its first and second derivative.
using Derivatives = std::tuple<double, double, double>;

/// A cubic spline at `x`: `breaks` (n,), and `coefficients` (n - 1, 4) from each break to the next,
/// the highest power first.
Derivatives spline_at(std::span<const double> breaks, Array2<const double> coefficients, double x);

/// m cubic splines over the same breaks: (n,), and (n - 1, m, 4).
struct SplineTables {
    std::span<const double> breaks;
    Array3<const double> coefficients;
    CATENARY_RECORD(breaks, coefficients)
    CATENARY_SHAPES("n>1, n-1 m 4")
};
/// Fill in values and slopes (m,) of splines at `x`.
void tables_at(const SplineTables& tables, double x, std::span<double> values,
               std::span<double> slopes);

/// The sum of amplitude sin(rate x + phase) at `x`.
Derivatives sines_at(std::span<const double> amplitudes, std::span<const double> rates,
                     std::span<const double> phases, double x);

/// Value and slope at a place of the line through points (x, y); level beyond its ends.
std::pair<double, double> line_at(std::span<const double> x, std::span<const double> y,
                                  double place);
/// Fill in both (s,) at places.
void polyline_at(std::span<const double> x, std::span<const double> y,
                 std::span<const double> places, std::span<double> values,
                 std::span<double> slopes);

}  // namespace catenary
