#pragma once
// Records that heads are made of. A head has n coordinates and s strips; its state are positions,
// velocities and accelerations one after the other (3 n,).
#include <optional>

#include "base/arrays.hpp"
#include "base/curves.hpp"
#include "heads/regulation.hpp"

namespace catenary {

/// Factors of Newmark's formulas, the same for all coordinates.
struct NewmarkFactors {
    double dt;                                  ///< step [s]
    double predict_position, predict_velocity;  ///< dt^2 (1/2 - beta) [s2], dt (1 - gamma) [s]
    double position, velocity;                  ///< beta dt^2 [s2], gamma dt [s]
    CATENARY_RECORD(dt, predict_position, predict_velocity, position, velocity)
};

/// Arrays of a head.
struct HeadArrays {
    Array3<double> touch;     ///< (2, s, n) by how much each coordinate raises each strip, and how
                              ///< fast that changes
    std::span<double> state;  ///< (3 n,) at the end of the latest step
    std::span<double> out;    ///< (2 s + 2 s^2,) heights and velocities of the strips without
                              ///< contact, and both matrices of compliance, row by row
    NewmarkFactors newmark;
    int64_t roll;  ///< coordinate of the head's roll, -1 without it
    CATENARY_RECORD(touch, state, out, newmark, roll)
    CATENARY_SHAPES("2 s n, 3n")
};

/// A step without contact of a chain of masses on linear springs and dampers, with forces F: new
/// state = matrix @ state + F by_drive + F_head by_head.
struct LinearStep {
    Array2<const double> matrix;       ///< (3 n, 3 n)
    std::span<const double> by_drive;  ///< (3 n,) of the force on the last mass
    std::span<const double> by_head;   ///< (3 n,) of that on the head
    Array2<const double> inverse;      ///< (n, n) of the matrix that gives accelerations
    CATENARY_RECORD(matrix, by_drive, by_head, inverse)
    CATENARY_SHAPES("3n 3n, 3n, 3n, n n")
};

/// A law's extension is way @ coordinates + by_base * base + by_roof * roof - zero; it pulls by a
/// table over this, or over its rate.
struct HeadLaw {
    double by_base;      ///< part of the base's height
    double by_roof;      ///< part of the roof's
    double zero;         ///< where extensions count from [m]
    int64_t of_rate;     ///< whether its points are rates
    int64_t begin, end;  ///< its points, two at least
};
struct HeadLawPoint {
    double at;     ///< [m] or [m/s]
    double force;  ///< [N]
};
/// m laws on n coordinates.
struct HeadLaws {
    Array2<const double> ways;  ///< (m, n)
    std::span<const HeadLaw> law;
    std::span<const HeadLawPoint> points;  ///< of all laws
    std::span<double> pressed;             ///< (s,) contact forces of the latest step [N]
    CATENARY_RECORD(ways, law, points, pressed)
    CATENARY_SHAPES("m n, m, *, s")
};

/// What raises a head, see mbs/mechanism/reduced_pantograph.py; its height is a coordinate.
struct ReducedMechanism {
    /// Columns of the tables; the last one may be missing.
    enum Column { kMass, kLift, kSlowing, kCarried, kBlown, kMostColumns };
    SplineTables tables;  ///< mass [kg], lift [N], damping [N s/m], carried mass [kg] and, of some,
                          ///< lift by the air [N], over the mechanism's height [m]
    double weight;        ///< of the head [N]
    double zero;          ///< the coordinate where the mechanism's height is zero [m]
    CATENARY_RECORD(tables, weight, zero)
};

/// Masses on linear springs and dampers, with laws, whose matrix is made anew in each step.
struct SprungMasses {
    std::span<const double> masses;           ///< (n,)
    Array2<const double> stiffness, damping;  ///< (n, n)
    std::span<const double> push;  ///< (n,) force on each coordinate by an upward unit force on the
                                   ///< strips' middle
    int64_t carrier;               ///< the coordinate that is driven
    HeadLaws laws;
    std::optional<ReducedMechanism> mechanism;  ///< that drives it, if it is no chain
    CATENARY_RECORD(masses, stiffness, damping, push, carrier, laws, mechanism)
    CATENARY_SHAPES("n, n n, n n, n, *, n=n s=s")
};

/// Strips that bend, see mbs/head/strips.py.
struct Bending {
    SplineTables tables;  ///< of m modes over the place on a strip [m]
    int64_t first;        ///< coordinate of the first strip's first mode, the others behind it
    int64_t wires;        ///< that may touch each strip
    CATENARY_RECORD(tables, first, wires)
};

/// Memory of a lowering. Heights are of the strips' mean over the housing, which catches the head.
struct LoweringMemory {
    double height;     ///< now [m]
    double caught_at;  ///< where it is caught [m], known from the lowering on
    double phase;      ///< 0 before the lowering, 1 during it, 2 when the head is caught
};

struct Lowering {
    double time;                       ///< after which it begins [s]
    double drop;                       ///< of the head until it is caught [m]
    std::span<LoweringMemory> memory;  ///< (1,)
    CATENARY_RECORD(time, drop, memory)
    CATENARY_SHAPES("*, *, 1")
};

/// All that a head is: its model is linear or sprung.
struct HeadParts {
    HeadArrays arrays;
    int64_t first;  ///< number of its first contact among the train's contacts
    std::optional<LinearStep> linear;
    std::optional<SprungMasses> sprung;
    std::optional<Bending> bending;
    std::optional<Regulation> regulation;
    std::optional<Lowering> lowering;
    CATENARY_RECORD(arrays, first, linear, sprung, bending, regulation, lowering)
    CATENARY_SHAPES("n=n s=s, *, n=n, n=n s=s")
};

}  // namespace catenary
