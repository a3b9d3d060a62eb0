#pragma once
// Pantographs stepped by Newmark's method: the row that drives a step, state, strips, contact; and
// the lowering under way until the head is caught, see mbs/lowering.py.
#include <vector>

#include "contact/contacts.hpp"
#include "heads/laws.hpp"

namespace catenary {

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
    /// Remember the latest contact forces, which laws read.
    virtual void remember(std::span<const double> contact_force);

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
    std::vector<double> free_;      ///< (3 n,) the state of the coming step without contact
    std::vector<double> by_force_;  ///< (3 n, s) its decrease by a unit of each contact force
    std::vector<double> shapes_, slopes_;  ///< room for modes
    /// Of sprung masses: predicted motion (paper eq. 2.5), force and matrix of the step.
    std::vector<double> position_, velocity_, force_, matrix_;
    std::optional<SettlingLaws> laws_;
    double roof_ = 0.0;  ///< height of the housing at the end of the step, as in `Drive` [m]
};

}  // namespace catenary
