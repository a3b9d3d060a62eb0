/* A prepared line with its pantographs, stepped from C: for hosts in real time, units of
 * co-simulation and environments to learn in. See docs/embedding.md.
 *
 * `catenary prepare CASE -o FILE` writes such a line. Forces are in N, lengths in m, times in s;
 * upward is positive. A step allocates nothing, locks nothing and makes no system call.
 * Different simulations may be stepped by different threads, one by one thread at a time. */
#ifndef CATENARY_H
#define CATENARY_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif
#define CATENARY_API __attribute__((visibility("default")))

typedef struct catenary_simulation catenary_simulation;

/* What a host adds to a pantograph, from the next step on. All are 0 at first. */
typedef struct {
    double lift_force;        /* added to the static force */
    double head_force;        /* on the head; strips on springs of their own share it */
    double base;              /* added to the height of the base */
    double base_velocity;     /* of that */
    double base_acceleration; /* of that; only pantographs with bodies read it */
} catenary_input;

/* What a step ended with. After CATENARY_NOT_FOUND and CATENARY_TURNED no further step is taken
 * until an earlier state is restored. */
enum {
    CATENARY_DONE = 0,
    CATENARY_NOT_FOUND = 1, /* no forces fit it, or a mechanism would leave the heights that it can
                             * reach */
    CATENARY_AT_END = 2,    /* the file has no inputs for a further step */
    CATENARY_TURNED = 3     /* a wire has turned from rest by more than a linear line bears: it
                             * has run away */
};

/* Read a line; NULL if that fails: `error` then holds why, in up to n_error bytes. */
CATENARY_API catenary_simulation* catenary_open(const char* path, char* error, size_t n_error);
CATENARY_API void catenary_close(catenary_simulation* simulation);

/* Take n steps, or as many as can be taken. */
CATENARY_API int catenary_step(catenary_simulation* simulation, int64_t n);

CATENARY_API double catenary_time(const catenary_simulation* simulation);
CATENARY_API double catenary_time_step(const catenary_simulation* simulation);
CATENARY_API int64_t catenary_steps_left(const catenary_simulation* simulation);
/* Way of the train since time zero, and its speed; another one holds from the next step on. It is
 * refused, with a value other than 0, if it is negative or not below the speed of the slowest wave
 * (as long as effects.supercritical_speed does not allow that), or if the file has what pantographs
 * meet at their places at one speed: wires across their strips, the track below the vehicle,
 * tunnels, stretches of the wind. */
CATENARY_API double catenary_way(const catenary_simulation* simulation);
CATENARY_API double catenary_speed(const catenary_simulation* simulation);
CATENARY_API int catenary_set_speed(catenary_simulation* simulation, double speed);

/* Arrays of a number for each pantograph, which last as long as the simulation. */
CATENARY_API int64_t catenary_n_pantographs(const catenary_simulation* simulation);
CATENARY_API catenary_input* catenary_inputs(catenary_simulation* simulation);
CATENARY_API const double* catenary_contact_force(const catenary_simulation* simulation);
CATENARY_API const double* catenary_head_height(const catenary_simulation* simulation);
CATENARY_API const double* catenary_wire_height(const catenary_simulation* simulation);

/* Keep the state in memory of `catenary_state_size` bytes, and come back to it. A state that this
 * file has not, or whose bytes were changed, is refused with a value other than 0; the simulation
 * stays where it is. */
CATENARY_API size_t catenary_state_size(const catenary_simulation* simulation);
CATENARY_API void catenary_save(const catenary_simulation* simulation, void* state);
CATENARY_API int catenary_restore(catenary_simulation* simulation, const void* state);

#ifdef __cplusplus
}
#endif
#endif
