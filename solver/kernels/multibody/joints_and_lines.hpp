#pragma once
// Rows of joints and lines of forces between bodies, all of a system at once. They know nothing of
// joints or forces by name; see mbs/rigid/arrays.py.
#include <vector>

#include "multibody/bodies.hpp"

namespace catenary {

/// n . w: n fixed on a body, and w from a point of body `start` to a point of body `end`, or else,
/// not `between`, a vector fixed on the latter.
struct BodyProduct {
    int64_t body, start, end;
    int64_t between;
    Vector3 normal;            ///< in the body's axes
    Vector3 at_start, at_end;  ///< in axes of `start` and `end` [m]
};
/// Results of m products, as in `Quantity` of mbs/rigid/kinematics.py.
struct BodyProducts {
    std::span<double> value;  ///< (m,)
    Array2<double> jacobian;  ///< (m, 6 n)
    std::span<double> rate, drift;
    CATENARY_RECORD(value, jacobian, rate, drift)
    CATENARY_SHAPES("m, m 6n, m, m")
};
void body_products(const BodyMotion& motion, std::span<const BodyProduct> rows,
                   const BodyProducts& result);

/// A line from a point of body i to a point of body j.
struct BodyLine {
    int64_t i, j;
    Vector3 at_i, at_j;  ///< in axes of the bodies [m]
};
/// Lengths (m,) [m], their rates (m,) [m/s] and gradients (m, 6 n). The gradient of two points that
/// coincide is not a number.
struct BodyLines {
    std::span<double> length, rate;
    Array2<double> gradient;
    CATENARY_RECORD(length, rate, gradient)
    CATENARY_SHAPES("m, m, m 6n")
};
void body_lines(const BodyMotion& motion, std::span<const BodyLine> lines, const BodyLines& result);

/// Numbers of rows that are not combinations of rows before them, by Gram-Schmidt, done twice. A
/// row is a combination if less than the part `dependent` of its length is left.
std::vector<int64_t> independent_rows(Array2<const double> matrix, double dependent);

}  // namespace catenary
