#pragma once
// Rigid bodies in space: where n bodies are and how they move, the frame at rest being one more;
// and rows of joints and lines of forces between them, all of a system at once. These know nothing
// of joints or forces by name; see mbs/rigid/joints.py.
#include <array>
#include <vector>

#include "base/arrays.hpp"

namespace catenary {

using Vector3 = std::array<double, 3>;

/// See `Motion` of mbs/rigid/bodies.py.
struct BodyMotion {
    Array2<const double> position;  ///< (n + 1, 3) [m]
    Array3<const double> rotation;  ///< (n + 1, 3, 3) from body to space axes
    Array2<const double> velocity;  ///< (n + 1, 3) [m/s], in space axes
    Array2<const double> spin;      ///< (n + 1, 3) [rad/s], in body axes
    CATENARY_RECORD(position, rotation, velocity, spin)
    CATENARY_SHAPES("n+1 3, n+1 3 3, n+1 3, n+1 3")

    int64_t n_bodies() const { return position.rows - 1; }
    /// A vector in body axes, in space axes.
    Vector3 turned(int64_t body, const Vector3& local) const;
    /// The angular velocity in space axes.
    Vector3 turning(int64_t body) const;
};

/// Fill in matrices (n, 3, 3) from body to space axes of unit Euler parameters (n, 4).
void rotation_matrices(Array2<const double> parameters, Array3<double> rotation);
/// Displace bodies in place by `step` (6 n,): translations, then turns in body axes. Euler
/// `parameters` (n + 1, 4) are normalised after the turn; `position` is (n + 1, 3).
void move_bodies(Array2<double> position, Array2<double> parameters, std::span<const double> step);
/// Add -omega x J omega to generalised forces (6 n,) in place; `inertia` (n, 3), `spin` (n + 1, 3).
void add_gyroscopic_moments(std::span<double> force, Array2<const double> inertia,
                            Array2<const double> spin);

/// n . w: n fixed on a body, and w from a point of body `start` to a point of body `end`, or else,
/// not `between`, a vector fixed on the latter.
struct BodyProduct {
    int64_t body, start, end;
    int64_t between;
    Vector3 normal;            ///< in the body's axes
    Vector3 at_start, at_end;  ///< in axes of `start` and `end` [m]
};
/// Results of m products, as in `Quantity` of mbs/rigid/bodies.py.
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
