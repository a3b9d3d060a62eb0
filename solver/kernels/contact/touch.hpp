#pragma once
// Places of strips on contact wires, and what is known of the wires and of heads there.
#include "base/arrays.hpp"

namespace catenary {

/// Far more than the round-off of a position, far less than an element [m].
inline constexpr double kSlip = 1e-6;

/// A node of a contact wire. As short as can be, since a line has very many.
struct Node {
    double x, y;       ///< along the track and across it [m]
    double rest[2];    ///< its unknowns (w, theta_y) at rest [m], [-]
    int64_t at;        ///< where its columns of A^-1 for both begin, one after the other
    int32_t begin;     ///< the first local unknown of both columns
    int32_t width;     ///< how long each of them is
    int32_t local[2];  ///< numbers of its unknowns on this rank, 0 where another one owns them
    int8_t owned[2];   ///< whether this rank does
    int8_t joined;     ///< whether an element joins it to the next one
};

/// A sample of the running surface of a contact wire.
struct Sample {
    double x, height, slope;  ///< along the track [m], above the wire's axis [m], [-]
};

/// A place of a strip on a contact wire, which is a candidate for a contact.
struct Touch {
    int64_t first, end;  ///< the wire's first node, and the one after its last
    double half_length;  ///< of the strip [m]
    double present;      ///< 1 if the wire is there on the strip, else 0: so are all functions then
    double x;            ///< along the track [m]
    int64_t element;     ///< first node of its element
    int64_t local[4];    ///< numbers of the element's unknowns on this rank, 0 where not owned
    double value[4];     ///< Hermite functions N of them, 0 where not owned
    double slope[4];     ///< dN/dx [1/m], 0 where not owned
    double whole_value[4];  ///< N and dN/dx without regard to owners
    double whole_slope[4];
    double rest[4];      ///< the unknowns at rest [m], [-]
    int64_t samples[2];  ///< first sample of the wire's running surface, and the one after its last
    int64_t sample;      ///< the sample before the place
    double surface[2];   ///< height [m] and slope [-] of the running surface here
    int64_t filled[2];  ///< first and one after the last local unknown that answers to a force here
};

/// Lateral motion of wires at n contacts: place y + v [m], its total rate
/// dv/dt + V (dy/dx + dv/dx) [m/s] and displacement v [m]. Empty without lateral motion.
struct Across {
    std::span<double> place, rate, moved;
    CATENARY_RECORD(place, rate, moved)
    CATENARY_SHAPES("n, n, n")
};

/// Heights and their rates at n contacts: `place` (n,) [m] and `rate` (n,) [m/s] without forces,
/// `by_force` (n, n) [m/N] and `rate_by_force` (n, n) [m/(N s)]: their increase by forces
/// for a line, their decrease for heads and depths.
struct Affine {
    std::span<double> place, rate;
    Array2<double> by_force, rate_by_force;
    CATENARY_RECORD(place, rate, by_force, rate_by_force)
    CATENARY_SHAPES("n, n, n n, n n")
};

}  // namespace catenary
