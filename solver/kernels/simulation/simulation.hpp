#pragma once
// A prepared line with its pantographs, stepped from outside: without Python, PETSc or MPI.
//
// It is read from a file, see `prepare`: factors, states, links, heads, and the inputs of each step
// that depend on time. A host takes steps, changes speed, lift, forces on heads and the motion of
// bases between them, and keeps states to come back to. A step allocates no memory and never
// waits.
#include <cstddef>
#include <memory>
#include <string>

#include "steps/steps.hpp"

namespace catenary {

/// A pantograph's spring and damper to its base, if it is a chain that is tied to it.
struct Tie {
    double stiffness, damping;  ///< [N/m], [N s/m]
};

/// Inputs of the steps to come.
struct Ahead {
    double dt;                       ///< [s]
    int64_t n_done;                  ///< steps taken from time zero on
    Array3<const double> drives;     ///< (n, n_heads, width) a row for each head, see `Drive`
    std::span<const Tie> ties;       ///< of each pantograph
    bool one_speed;                  ///< whether drives hold for the train's first speed only
    double most_speed;               ///< below which the train can have any speed [m/s]
    double longest_way;              ///< of the train, to where the line ends [m]
    std::span<const int64_t> turns;  ///< unknowns of rotation of all wires
    double most_turn;                ///< from rest, up to which the line is linear [rad]
    int64_t look_steps;              ///< steps in which each of them is looked at once
    CATENARY_RECORD(dt, n_done, drives, ties, one_speed, most_speed, longest_way, turns, most_turn,
                    look_steps)
    CATENARY_SHAPES("*, *, * h *, h, *, *, *, *")
};

/// All that a prepared line is.
struct PreparedLine {
    StepParts steps;
    PassParts passes;
    TrackedLinks tracked;
    std::optional<Window> window;
    std::vector<HeadParts> heads;
    Ahead ahead;
    CATENARY_RECORD(steps, passes, tracked, window, heads, ahead)
};

/// A block of bytes that was read, in memory of its own, and where it stood when it was written.
struct OwnBlock {
    uintptr_t stood;
    std::unique_ptr<std::byte[]> memory;
    std::span<std::byte> bytes;
    bool changes;  ///< whether any array in it is written
};

/// FNV-1a, by words of eight bytes: it detects damaged bytes, not forged ones.
class CheckSum {
  public:
    void take(const void* data, size_t n);
    uint64_t sum() const { return sum_; }

  private:
    uint64_t sum_ = 0xcbf29ce484222325u;
};

/// Write a line to a file. Throws std::runtime_error if that fails.
void write_line(const std::string& path, PreparedLine& line);
/// Read it, with the memory of its arrays; returns the checksum of the file. Throws
/// std::runtime_error if it cannot be read, is of another version, or was damaged.
uint64_t read_line(const std::string& path, PreparedLine& line, std::vector<OwnBlock>& blocks);

/// Inputs of a pantograph that a host adds, from the next step on.
struct Input {
    double lift_force = 0.0;         ///< added to the static force [N]
    double head_force = 0.0;         ///< upward on the head, or shared by strips on springs [N]
    double base = 0.0;               ///< added height of the base [m]
    double base_velocity = 0.0;      ///< [m/s]
    double base_acceleration = 0.0;  ///< [m/s2]; read by mechanisms
};

class Simulation {
  public:
    /// Throws std::runtime_error, with the path and why, if it is no whole file of this version.
    /// Numbers of places in it are not checked: trust it only as far as a program.
    explicit Simulation(const std::string& path);

    enum class Outcome {
        kDone,
        kNotFound,  ///< no forces fit a step, or a mechanism would leave the heights that it can
                    ///< reach
        kAtEnd,     ///< the line ends, or the file has no inputs for a further step
        kTurned,    ///< a wire has turned by more than `Ahead::most_turn`
    };
    /// Take n steps, as far as that is possible. What is not found, or has turned, stays so until
    /// an earlier state is restored.
    Outcome step(int64_t n);

    double time() const { return n_done_ * line_.ahead.dt; }  ///< [s]
    double dt() const { return line_.ahead.dt; }
    double way() const { return steps_->way(time()); }  ///< of the train since it started [m]
    double speed() const { return steps_->course().speed; }
    double most_speed() const { return line_.ahead.most_speed; }
    double most_turn() const { return line_.ahead.most_turn; }
    /// Give the train another speed [m/s], if it can have one; whether it can.
    bool set_speed(double speed);
    std::span<Input> inputs() { return inputs_; }  ///< of each pantograph
    const TrainOutputs& outputs() const { return line_.steps.train_outputs; }
    int64_t n_steps_left() const { return line_.ahead.drives.n - (n_done_ - line_.ahead.n_done); }

    /// A state to come back to, and how large one is. Its last bytes are a checksum of the others
    /// and of the file: indices in it are not checked otherwise.
    size_t state_size() const { return state_size_; }
    void save(std::byte* state) const;
    /// Come back to a state; false, and nothing changes, if it is none of this file or was damaged.
    bool restore(const std::byte* state);

  private:
    struct Place;
    void make_steps();
    uint64_t sum_of(const std::byte* state) const;
    Outcome take_one();
    bool has_turned() const;
    void drive_next();

    std::vector<OwnBlock> blocks_;
    PreparedLine line_{};
    std::unique_ptr<TwoPasses> free_;
    std::unique_ptr<Room> room_;
    std::vector<std::unique_ptr<Head>> heads_;
    std::vector<Input> inputs_;
    // The block of one step.
    std::vector<double> times_ = {0.0}, drive_;
    std::vector<int64_t> now_ = {0, 0};
    std::vector<Counts> counts_ = {Counts{}};
    std::optional<Steps> steps_;
    int64_t n_done_ = 0;
    Outcome latest_ = Outcome::kDone;
    size_t state_size_ = 0;
    uint64_t file_sum_ = 0;
};

}  // namespace catenary
