#pragma once
// Hermite functions of an element of a beam at a place.
#include <array>

namespace catenary {

/// Functions N at `xi` in [0, 1] of an element's `length` [m]: w(x) = sum of N times unknowns [m].
inline std::array<double, 4> shape_values(double xi, double length) {
    const double square = xi * xi, cube = xi * xi * xi;
    return {1 - 3 * square + 2 * cube, length * (xi - 2 * square + cube), 3 * square - 2 * cube,
            length * (cube - square)};
}

/// Derivatives dN/dx [1/m], of those of rotations [-].
inline std::array<double, 4> shape_slopes(double xi, double length) {
    const double square = xi * xi;
    return {6 * (square - xi) / length, 1 - 4 * xi + 3 * square, 6 * (xi - square) / length,
            3 * square - 2 * xi};
}

}  // namespace catenary
