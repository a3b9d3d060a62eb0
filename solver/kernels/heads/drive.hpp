#pragma once
// What a step of a head depends on besides its state, as a row of numbers that is known before.
#include "base/arrays.hpp"

namespace catenary {

/// The first numbers of a row. Upward is positive; a model reads those that it needs.
struct Drive {
    double time;                 ///< at the end of the step [s]
    double force;                ///< on the last mass of a chain [N]
    double part;                 ///< of the lift that acts
    double base;                 ///< height of the base [m], over where it rests
    double base_velocity;        ///< [m/s]
    double base_acceleration;    ///< [m/s2]
    double roof, roof_velocity;  ///< height of what catches a head that is lowered, over where it
                                 ///< rests [m], and velocity [m/s]
    double head_air;             ///< force of the air on the head [N]
    double arm_air;              ///< force of the air on the arm of a mechanism [N]
    double bodies_air;  ///< what it lifts by the mechanism's bodies, in parts of the tables'
};
inline constexpr int64_t kDrive = sizeof(Drive) / sizeof(double);

/// A row (kDrive + 2 s,) of a head with s strips: behind its `Drive` where wires are on the strips,
/// to the left of their middle [m], and how fast that changes [m/s].
template <class Number>
struct DriveRow {
    std::span<Number> numbers;
    int64_t n_strips;

    const Drive& drive() const { return *reinterpret_cast<const Drive*>(numbers.data()); }
    std::span<Number> place() const { return part(numbers, kDrive, kDrive + n_strips); }
    std::span<Number> rate() const {
        return part(numbers, kDrive + n_strips, kDrive + 2 * n_strips);
    }
};

}  // namespace catenary
