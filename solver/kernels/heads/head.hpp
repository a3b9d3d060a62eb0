#pragma once
// Pantographs stepped by Newmark's method: the row that drives a step, state, strips, contact. With
// a regulated lift, filter, samples, gains, limits, delay (mbs/head/laws.py); laws that are not
// linear, tables that settle within a step (mbs/head/laws.py); and the lowering under way until the
// head is caught (mbs/head/stepping.py).
//
// A head has n coordinates and s strips; its state are positions, velocities and accelerations one
// after the other (3 n,).
#include <functional>
#include <optional>
#include <vector>

#include "base/arrays.hpp"
#include "base/curves.hpp"
#include "contact/contacts.hpp"

namespace catenary {

struct RegulationSettings {
    double of_height;    ///< 1 if the head's height is measured, 0 for the contact force
    double target;       ///< wanted value [m] or [N]
    double part;         ///< share of the deviation that the filter takes in a step [-]
    double dt;           ///< step [s]
    double sample;       ///< time between samples [s]
    double least, most;  ///< added force [N]
};

/// ControlGains where a value is measured; straight in between, constant beyond the ends.
struct ControlGains {
    double measured;  ///< [m] or [N]
    double of_error, of_integral, of_rate;
};

struct RegulationMemory {
    double time;      ///< [s]
    double next;      ///< when the next sample is [s]
    double filtered;  ///< measured value after the filter [m] or [N]
    double integral;  ///< of the error [.. s]
    double error;     ///< at the latest sample
    double samples;   ///< how many there were, -1 before the first step
    double acting;    ///< added force [N]
};

struct Regulation {
    std::span<const RegulationSettings> settings;  ///< (1,)
    std::span<const ControlGains> gains;           ///< one row at least
    std::span<RegulationMemory> memory;            ///< (1,)
    std::span<double> waiting;                     ///< forces that wait, one a sample of delay [N]
    CATENARY_RECORD(settings, gains, memory, waiting)
    CATENARY_SHAPES("1, g>0, 1")
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

/// What raises a head, see mbs/mechanism/reduction.py; its height is a coordinate.
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

/// Start of a step: Newmark's predictors and the other variables of laws.
struct StepStart {
    std::span<const double> position, velocity;  ///< predicted (n,)
    std::span<const double> acceleration;        ///< of the state (n,)
    Array2<const double> touch;                  ///< (s, n), see `HeadArrays`
    double base, base_velocity;                  ///< [m], [m/s]
    double roof, roof_velocity;                  ///< [m], [m/s]
};

/// The laws of a head, with room to settle in.
class SettlingLaws {
  public:
    SettlingLaws(const HeadLaws& laws, int64_t n);
    /// Add the laws to a step's `force` (n,) and `matrix` (n, n), and invert the latter in place.
    ///
    /// Each law is taken along the segment of its table in which the step ends under the contact
    /// forces of the step before: first where the accelerations of the start lead to, then again
    /// until all segments stay.
    void settle(const StepStart& start, const NewmarkFactors& newmark, std::span<double> force,
                Array2<double> matrix);

  private:
    bool find_segments(const StepStart& start, const NewmarkFactors& newmark);
    void add(int64_t law, const StepStart& start, const NewmarkFactors& newmark,
             std::span<double> force, Array2<double> matrix) const;

    HeadLaws laws_;
    std::vector<double> plain_force_, plain_matrix_, acceleration_;
    std::vector<int64_t> segment_;
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

/// A head's strips on n coordinates, which a step advances together.
class Head {
  public:
    /// Throws std::invalid_argument if shapes do not agree.
    explicit Head(const HeadParts& parts);
    virtual ~Head() = default;
    Head(const Head&) = delete;
    Head& operator=(const Head&) = delete;

    int64_t n() const { return n_; }
    int64_t n_strips() const { return n_strips_; }
    const HeadParts& parts() const { return parts_; }
    const HeadArrays& arrays() const { return parts_.arrays; }
    int64_t first() const { return parts_.first; }
    void set_first(int64_t contact) { parts_.first = contact; }

    /// Add bending of the strips.
    void bend(const Bending& bending);
    /// Add a regulation of the lift.
    void regulate(const Regulation& regulation) { parts_.regulation = regulation; }
    /// Add a lowering, at whose end the head is caught.
    void lower(const Lowering& lowering) { parts_.lowering = lowering; }
    /// Force that the regulation now adds to the static force [N].
    double added_force() const {
        return added_force_ + (parts_.regulation ? parts_.regulation->memory.front().acting : 0.0);
    }
    /// Put the added force [N] of a controller that no kernel knows.
    void set_added_force(double force) { added_force_ = force; }
    /// Have a function called at the end of each step, with its time [s] and contact forces [N].
    using After = std::function<void(double, std::span<const double>)>;
    void then(After after) { after_ = std::move(after); }

    /// Height at which a mechanism's tables were taken in the latest step [m].
    double height() const { return height_; }

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
    void move(std::span<const double> force) { advance(part(force, first(), first() + n_strips_)); }

  protected:
    /// A head whose steps another class takes.
    explicit Head(const HeadArrays& arrays);
    /// Step from the state to that without contact and fill `out`; whether the head is where its
    /// model reaches. NaN passes, for the coupling to find.
    virtual bool step_free(const Drive& drive);

  private:
    void step_linear(const Drive& drive);
    bool step_sprung(const Drive& drive);
    /// Add a mechanism to the step's force and matrix; whether its height is within the tables.
    bool raise(const Drive& drive, const ReducedMechanism& mechanism);
    /// Fill in `out` and the answers to contact forces, with the `inverse` (n, n) of the matrix of
    /// accelerations.
    void respond(Array2<const double> inverse);
    /// The acting part of the force that the regulation adds [N], 0 if no lift acts.
    double added(const Drive& drive) const {
        const double force = added_force();
        return force != 0.0 && drive.part > 0.0 ? drive.part * force : 0.0;
    }
    /// Positions, velocities and accelerations of the state: its parts 0, 1, 2.
    std::span<const double> state(int64_t number) const {
        return part<const double>(arrays().state, number * n_, (number + 1) * n_);
    }
    const NewmarkFactors& newmark() const { return arrays().newmark; }
    /// Whether the head is caught and moves with its housing; fills `out` if so.
    bool is_held(const Drive& drive);
    /// Height of the strips' mean over the housing under contact forces (s,) [N], [m].
    double height_under(std::span<const double> contact_force) const;
    /// Put where wires are on the strips into `touch`.
    void aim(std::span<const double> drive);
    double measured(std::span<const double> contact_force) const;
    Array2<double> by_force() { return {by_force_.data(), 3 * n_, n_strips_}; }

    HeadParts parts_;
    int64_t n_, n_strips_;
    double added_force_ = 0.0, height_ = 0.0;
    double time_ = 0.0;  ///< at the end of the step [s]
    After after_;
    std::vector<double> free_;      ///< (3 n,) the state of the coming step without contact
    std::vector<double> by_force_;  ///< (3 n, s) its decrease by a unit of each contact force
    std::vector<double> shapes_, slopes_;  ///< room for modes
    /// Of sprung masses: predicted motion (paper eq. 2.5), force and matrix of the step.
    std::vector<double> position_, velocity_, force_, matrix_;
    std::optional<SettlingLaws> laws_;
    double roof_ = 0.0;  ///< height of the housing at the end of the step, as in `Drive` [m]
};

}  // namespace catenary
