// A prepared line, stepped from outside, and as C sees it.
#include "simulation/simulation.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <new>
#include <stdexcept>

#include "base/flush_to_zero.hpp"
#include "simulation/catenary.h"

namespace catenary {

/// Part of a saved state besides inputs and blocks.
struct Simulation::Place {
    int64_t n_done;
    Course course;
    int64_t latest;
};

Simulation::Simulation(const std::string& path) {
    try {
        file_sum_ = read_line(path, line_, blocks_);
        make_steps();
    } catch (const std::runtime_error& error) {
        throw std::runtime_error(path + ": " + error.what());
    }
}

void Simulation::make_steps() {
    StepParts& parts = line_.steps;
    const Ahead& ahead = line_.ahead;
    n_done_ = ahead.n_done;
    const size_t n = line_.heads.size();
    if (n == 0 || ahead.drives.rows != static_cast<int64_t>(n) || ahead.ties.size() != n)
        throw std::runtime_error("pantographs are missing in it");
    if (ahead.look_steps < 1) throw std::runtime_error("it never looks at its wires");
    try {
        free_ = std::make_unique<TwoPasses>(line_.passes);
        for (const HeadParts& head : line_.heads) heads_.push_back(std::make_unique<Head>(head));
    } catch (const std::invalid_argument& error) {
        throw std::runtime_error(error.what());
    }
    free_->track(line_.tracked);
    if (line_.window) free_->open(*line_.window);
    parts.free = free_.get();
    room_ = std::make_unique<Room>(size(parts.switched));
    parts.problem.room = room_.get();
    parts.heads.clear();
    for (const auto& head : heads_) parts.heads.push_back(head.get());
    inputs_.resize(n);
    drive_.resize(ahead.drives.rows * ahead.drives.columns);
    Block block{};
    block.times = times_;
    block.drives = {drive_.data(), 1, ahead.drives.rows, ahead.drives.columns};
    block.now = now_;
    block.counts = counts_;
    steps_.emplace(parts, block);
    state_size_ = sizeof(Place) + inputs_.size() * sizeof(Input);
    for (const OwnBlock& own : blocks_) state_size_ += own.changes ? own.bytes.size() : 0;
    state_size_ += sizeof(uint64_t);
}

Simulation::Outcome Simulation::step(int64_t n) {
    const FlushedSubnormals flushed;
    if (latest_ == Outcome::kAtEnd) latest_ = Outcome::kDone;  // it may have another speed now
    for (int64_t k = 0; k < n && latest_ == Outcome::kDone; ++k) latest_ = take_one();
    return latest_;
}

Simulation::Outcome Simulation::take_one() {
    const double time = static_cast<double>(n_done_ + 1) * line_.ahead.dt;
    if (n_steps_left() <= 0 || steps_->way(time) > line_.ahead.longest_way) return Outcome::kAtEnd;
    times_[0] = time;
    drive_next();
    if (steps_->take(0, 1).n_steps == 0) return Outcome::kNotFound;
    ++n_done_;
    return has_turned() ? Outcome::kTurned : Outcome::kDone;
}

/// Whether one of the wires' rotations is beyond what the line bears. A step looks at a part of
/// them, so that it takes no longer than the one before.
bool Simulation::has_turned() const {
    const Ahead& ahead = line_.ahead;
    const int64_t n = size(ahead.turns), part = n_done_ % ahead.look_steps;
    for (int64_t k = n * part / ahead.look_steps; k < n * (part + 1) / ahead.look_steps; ++k)
        if (!(std::abs(displacement_at(ahead.turns[k], line_.steps.contacts.motion)) <=
              ahead.most_turn))
            return true;
    return false;
}

/// Put the inputs of the next step: the file's plus the host's.
void Simulation::drive_next() {
    const auto rows = line_.ahead.drives[n_done_ - line_.ahead.n_done];
    std::ranges::copy(rows.all(), drive_.begin());
    for (size_t k = 0; k < heads_.size(); ++k) {
        Drive& drive = *reinterpret_cast<Drive*>(&drive_[k * rows.columns]);
        const Input& input = inputs_[k];
        const Tie& tie = line_.ahead.ties[k];
        drive.force += tie.stiffness * input.base + tie.damping * input.base_velocity;
        drive.base += input.base;
        drive.base_velocity += input.base_velocity;
        drive.base_acceleration += input.base_acceleration;
        drive.roof += input.base;
        drive.roof_velocity += input.base_velocity;
        drive.head_air += input.head_force;
        // In full at all times, unlike what a regulation of the scene adds.
        const auto& sprung = line_.heads[k].sprung;
        (sprung && sprung->mechanism ? drive.arm_air : drive.force) += input.lift_force;
    }
}

bool Simulation::set_speed(double speed) {
    if (line_.ahead.one_speed || !(speed >= 0.0 && speed < most_speed() && std::isfinite(speed)))
        return false;
    steps_->change_speed(time(), speed);
    return true;
}

/// Checksum of a state of this file without its last bytes.
uint64_t Simulation::sum_of(const std::byte* state) const {
    CheckSum check;
    check.take(&file_sum_, sizeof file_sum_);
    check.take(state, state_size_ - sizeof(uint64_t));
    return check.sum();
}

void Simulation::save(std::byte* state) const {
    std::byte* const start = state;
    auto put = [&](const void* from, size_t n) {
        std::memcpy(state, from, n);
        state += n;
    };
    const Place place{n_done_, steps_->course(), static_cast<int64_t>(latest_)};
    put(&place, sizeof place);
    put(inputs_.data(), inputs_.size() * sizeof(Input));
    for (const OwnBlock& own : blocks_)
        if (own.changes) put(own.bytes.data(), own.bytes.size());
    const uint64_t sum = sum_of(start);
    put(&sum, sizeof sum);
}

bool Simulation::restore(const std::byte* state) {
    uint64_t sum;
    std::memcpy(&sum, state + state_size_ - sizeof sum, sizeof sum);
    if (sum != sum_of(state)) return false;
    auto get = [&](void* to, size_t n) {
        std::memcpy(to, state, n);
        state += n;
    };
    Place place;
    get(&place, sizeof place);
    n_done_ = place.n_done;
    latest_ = static_cast<Outcome>(place.latest);
    steps_->set_course(place.course);
    get(inputs_.data(), inputs_.size() * sizeof(Input));
    for (OwnBlock& own : blocks_)
        if (own.changes) get(own.bytes.data(), own.bytes.size());
    return true;
}

}  // namespace catenary

using catenary::Input;
using catenary::Simulation;

struct catenary_simulation {
    Simulation own;
};

static_assert(sizeof(catenary_input) == sizeof(Input));
static_assert(CATENARY_DONE == int(Simulation::Outcome::kDone));
static_assert(CATENARY_NOT_FOUND == int(Simulation::Outcome::kNotFound));
static_assert(CATENARY_AT_END == int(Simulation::Outcome::kAtEnd));
static_assert(CATENARY_TURNED == int(Simulation::Outcome::kTurned));

catenary_simulation* catenary_open(const char* path, char* error, size_t n_error) {
    std::string why;
    try {
        return new catenary_simulation{Simulation(path)};
    } catch (const std::bad_alloc&) {
        why = "there is not enough memory for it";
    } catch (const std::exception& thrown) {
        why = thrown.what();
    }
    if (error && n_error > 0) {
        const size_t n = std::min(n_error - 1, why.size());
        std::copy_n(why.data(), n, error);
        error[n] = '\0';
    }
    return nullptr;
}
void catenary_close(catenary_simulation* simulation) {
    delete simulation;
}
int catenary_step(catenary_simulation* simulation, int64_t n) {
    return static_cast<int>(simulation->own.step(n));
}
double catenary_time(const catenary_simulation* simulation) {
    return simulation->own.time();
}
double catenary_time_step(const catenary_simulation* simulation) {
    return simulation->own.dt();
}
int64_t catenary_steps_left(const catenary_simulation* simulation) {
    return simulation->own.n_steps_left();
}
double catenary_way(const catenary_simulation* simulation) {
    return simulation->own.way();
}
double catenary_speed(const catenary_simulation* simulation) {
    return simulation->own.speed();
}
int catenary_set_speed(catenary_simulation* simulation, double speed) {
    return simulation->own.set_speed(speed) ? 0 : 1;
}
int64_t catenary_n_pantographs(const catenary_simulation* simulation) {
    return static_cast<int64_t>(simulation->own.outputs().contact_force.size());
}
catenary_input* catenary_inputs(catenary_simulation* simulation) {
    return reinterpret_cast<catenary_input*>(simulation->own.inputs().data());
}
const double* catenary_contact_force(const catenary_simulation* simulation) {
    return simulation->own.outputs().contact_force.data();
}
const double* catenary_head_height(const catenary_simulation* simulation) {
    return simulation->own.outputs().head_height.data();
}
const double* catenary_wire_height(const catenary_simulation* simulation) {
    return simulation->own.outputs().wire_height.data();
}
size_t catenary_state_size(const catenary_simulation* simulation) {
    return simulation->own.state_size();
}
void catenary_save(const catenary_simulation* simulation, void* state) {
    simulation->own.save(static_cast<std::byte*>(state));
}
int catenary_restore(catenary_simulation* simulation, const void* state) {
    return simulation->own.restore(static_cast<const std::byte*>(state)) ? 0 : 1;
}
