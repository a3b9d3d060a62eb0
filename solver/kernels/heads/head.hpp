#pragma once
// Base of all pantographs stepped by Newmark's method: the row that drives a step, state, strips,
// contact; and the lowering under way until the head is caught, see mbs/lowering.py.
//
// A pantograph has n coordinates and s strips. Its state are positions, velocities and
// accelerations one after the other (3 n,).
#include <optional>
#include <vector>

#include "base/arrays.hpp"
#include "base/curves.hpp"
#include "contact/touch.hpp"
#include "heads/regulation.hpp"

namespace catenary {

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

/// Inputs of a head's step besides its state: the first numbers of a row that is known before the
/// step. Upward is positive; a model reads the ones that it needs.
struct Drive {
    double time;                 ///< at the end of the step [s]
    double force;                ///< on the last mass of a chain [N]
    double part;                 ///< of the lift that acts
    double base;                 ///< height of the base [m], over where it rests
    double base_velocity;        ///< [m/s]
    double base_acceleration;    ///< [m/s2]
    double roof, roof_velocity;  ///< height of the roof, with stops and the housing that catches a
                                 ///< lowered head, over where it rests [m], and velocity [m/s]
    double head_air;             ///< force of the air on the head [N]
    double arm_air;              ///< force of the air on the arm of a mechanism [N]
    double bodies_air;  ///< lift by the air on the mechanism's bodies, in parts of the tables'
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

/// Strips that bend, see mbs/head/strips.py.
struct Bending {
    SplineTables tables;  ///< of m modes over the place on a strip [m]
    int64_t first;        ///< coordinate of the first strip's first mode, the others behind it
    int64_t wires;        ///< that may touch each strip
    CATENARY_RECORD(tables, first, wires)
};

/// A head's strips on n coordinates, which a step advances together.
class Head {
  public:
    /// Throws std::invalid_argument if shapes do not agree.
    explicit Head(const HeadArrays& arrays);
    virtual ~Head() = default;
    Head(const Head&) = delete;
    Head& operator=(const Head&) = delete;

    int64_t n() const { return n_; }
    int64_t n_strips() const { return n_strips_; }
    /// Number of its first contact among the train's contacts.
    int64_t first() const { return first_; }
    void set_first(int64_t contact) { first_ = contact; }

    /// Add bending of the strips.
    void bend(const Bending& bending);
    /// Add a regulation of the lift.
    void regulate(const Regulation& regulation) { regulation_ = regulation; }
    /// Add a lowering, at whose end the head is caught.
    void lower(const Lowering& lowering) { lowering_ = lowering; }
    /// Force that the regulation now adds to the static force [N].
    double added_force() const {
        return added_force_ + (regulation_ ? regulation_->memory.front().acting : 0.0);
    }
    /// Put the added force [N] of a controller that no kernel knows.
    void set_added_force(double force) { added_force_ = force; }

    /// Lowering, bending strips and regulation of the lift, each if there is one.
    const std::optional<Lowering>& lowering() const { return lowering_; }
    const std::optional<Bending>& bending() const { return bending_; }
    const std::optional<Regulation>& regulation() const { return regulation_; }
    const HeadArrays& arrays() const { return arrays_; }

    /// Step without contact, with a row of a `Drive`: fills `out`. Whether the head is where its
    /// model reaches.
    bool step(std::span<const double> drive);
    /// Make the state that under contact forces (s,) [N], after a step without.
    void advance(std::span<const double> contact_force);
    /// Heights and velocities (2, s) of the strips by Newmark's predictor (paper eq. 2.5).
    void extrapolate(std::span<const double> drive, Array2<double> early);

    /// Add to a row where wires are across the track at the train's n contacts, and note in `place`
    /// (n,) where they are on the strips then, NaN where none is there.
    void cross(std::span<double> drive, const Across& across, std::span<const Touch> touches,
               std::span<double> place) const;
    /// `step`, whose results are put into the train's `numbers` (2 n + 2 n^2,).
    bool predict(std::span<const double> drive, std::span<double> numbers, int64_t n_contacts);
    /// Decrease of the state by a unit of each contact force, (3 n, s), in the latest step.
    Array2<const double> answers() const { return {by_force_.data(), 3 * n_, n_strips_}; }
    /// `advance` with forces at all contacts of the train.
    void move(std::span<const double> force) { advance(part(force, first_, first_ + n_strips_)); }

  protected:
    /// Fill `free()` and call `respond`.
    virtual bool step_free(const Drive& drive) = 0;
    /// Remember the latest contact forces.
    virtual void remember(std::span<const double>) {}
    /// Fill in `out` and the answers to contact forces, with the `inverse` (n, n) of the matrix of
    /// accelerations.
    void respond(Array2<const double> inverse);
    /// The acting part of the force that the regulation adds [N], 0 if no lift acts.
    double added(const Drive& drive) const {
        const double force = added_force();
        return force != 0.0 && drive.part > 0.0 ? drive.part * force : 0.0;
    }

    const NewmarkFactors& newmark() const { return arrays_.newmark; }
    Array2<const double> touch() const { return arrays_.touch[0]; }
    std::span<const double> position() const { return state_part(arrays_.state, 0); }
    std::span<const double> velocity() const { return state_part(arrays_.state, 1); }
    std::span<const double> acceleration() const { return state_part(arrays_.state, 2); }
    std::span<const double> state() const { return arrays_.state; }
    /// The state (3 n,) of the coming step without contact.
    std::span<double> free() { return free_; }

  private:
    template <class Number>
    std::span<Number> state_part(std::span<Number> state, int64_t number) const {
        return part(state, number * n_, (number + 1) * n_);
    }
    /// Whether the head is caught and moves with its housing; fills `out` if so.
    bool is_held(const Drive& drive);
    /// Height of the strips' mean over the housing under contact forces (s,) [N], [m].
    double height_under(std::span<const double> contact_force) const;
    /// Put where wires are on the strips into `touch`.
    void aim(std::span<const double> drive);
    void bend_at(std::span<const double> place, std::span<const double> rate);
    double measured(std::span<const double> contact_force) const;
    Array2<double> by_force() { return {by_force_.data(), 3 * n_, n_strips_}; }

    HeadArrays arrays_;
    int64_t n_, n_strips_, first_ = 0;
    double added_force_ = 0.0;
    std::vector<double> free_;
    std::vector<double> by_force_;  ///< (3 n, s) its decrease by a unit of each contact force
    std::optional<Bending> bending_;
    std::vector<double> shapes_, slopes_;  ///< room for modes
    std::optional<Regulation> regulation_;
    std::optional<Lowering> lowering_;
    double roof_ = 0.0;  ///< height of the housing at the end of the step, as in `Drive` [m]
};

}  // namespace catenary
