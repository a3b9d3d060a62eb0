#pragma once
// Steps of the scheme `one_solve` on one rank: a step of the line without contact, the small
// problem of contact forces and switching links, and the motion of line and pantographs by both.
#include <optional>

#include "contact/contacts.hpp"
#include "contact/response.hpp"
#include "contact_problem/small_problem.hpp"
#include "heads/head.hpp"
#include "loads/loads.hpp"
#include "motion/motion.hpp"
#include "motion/two_passes.hpp"

namespace catenary {

/// Arguments of steps: line, heads, contacts, loads, and their outputs.
struct StepParts {
    double speed;              ///< of the train [m/s]
    TrainPlaces train;         ///< places of its contacts
    Contacts contacts;         ///< arrays of these contacts
    TwoPasses* free;           ///< the line's step without contact; null if others take it
    std::vector<Loads> loads;  ///< that change with time, or none
    std::vector<Head*> heads;  ///< of the pantographs
    std::span<double> strips;  ///< all strips as functions of the forces, see `Head::predict`
    SmallProblem problem;      ///< of a step's forces
    StepLaw law;               ///< of the contacts
    std::span<double> lateral_place;  ///< (n,) places of wires on the strips [m], or empty
    std::span<int64_t> switched;      ///< room for the numbers of links with a compensation
    TrainOutputs train_outputs;       ///< part of `outputs` that a step fills in
    std::span<const double> outputs;  ///< all outputs of pantographs
    std::optional<Shown> shown;       ///< outputs of the line, none if others take them
    std::vector<std::span<const double>> channels;  ///< numbers of further channels
    CATENARY_RECORD(speed, contacts, train, free, loads, heads, strips, problem, law, lateral_place,
                    switched, train_outputs, outputs, shown, channels)
    CATENARY_SHAPES("*, n=n, n=n.., *, *, *, *, n=n, n=n, n?")
};

/// Inputs and outputs of a block of steps.
struct Block {
    std::span<const double> times;    ///< (n,) at their ends [s]
    Array3<double> drives;            ///< (n, n_heads, width) a row for each head, see `Drive`
    Array2<double> rows;              ///< (n, width) outputs of each step; none without observers
    std::span<int64_t> now;           ///< stations that move in this block, first and last + 1
    Array2<const int64_t> behind;     ///< (n, 2) of each row, stations moved since it was filled
    std::optional<KeptMotions> kept;  ///< of steps with rows
    std::span<Counts> counts;         ///< (1,)
    CATENARY_RECORD(times, drives, rows, now, behind, kept, counts)
    CATENARY_SHAPES("n, n h w, *, 2, *, *, 1")
};

/// How far a block of steps has come.
struct Taken {
    int64_t n_steps;  ///< that were taken
    /// Whether the next one is begun: up to its free step, as its forces are left to others.
    bool begun;
    bool is_full;  ///< whether there is no room for the motion of the last one
};

/// Where the train is: at `way` [m] at a time `since` [s], and from there on with a speed [m/s].
struct Course {
    double speed, way = 0.0, since = 0.0;
};

class Steps {
  public:
    /// Throws std::invalid_argument if parts and block do not agree.
    Steps(StepParts parts, Block block);
    virtual ~Steps() = default;
    /// Way of the train at a time [s] since time zero [m].
    double way(double time) const { return course_.way + course_.speed * (time - course_.since); }
    const StepParts& parts() const { return parts_; }
    int64_t n_steps() const { return size(block_.times); }  ///< of the block
    const Course& course() const { return course_; }
    void set_course(const Course& course) {
        course_ = course;
        parts_.contacts.gains.train_speed = course.speed;
    }
    /// Give the train another speed [m/s] from a time [s] on.
    void change_speed(double time, double speed) { set_course({speed, way(time), time}); }
    /// Take the steps of the block from number `first` on up to before `end`. Throws
    /// std::out_of_range if it has not as many.
    Taken take(int64_t first, int64_t end);

    /// The parts of a step before and after its free step, where others take the latter. `arrive`
    /// returns whether forces were found.
    void set_off(int64_t number);
    bool arrive(int64_t number);
    /// Fill in the row of a step that has been taken.
    void show(int64_t number);

  protected:
    const Block& block() const { return block_; }
    /// Links that had a row in the latest step, which are the first of `switched`.
    int64_t n_compensations() const { return n_compensations_; }

  private:
    bool predict_heads(int64_t number);
    int64_t find_forces(int64_t number);
    void finish(int64_t n_compensations);
    void check() const;

    StepParts parts_;
    Block block_;
    Course course_;
    int64_t n_compensations_ = 0;
};

}  // namespace catenary
