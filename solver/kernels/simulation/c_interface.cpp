// The simulation as C sees it.
#include <algorithm>
#include <new>

#include "simulation/catenary.h"
#include "simulation/simulation.hpp"

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
