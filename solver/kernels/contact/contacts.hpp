#pragma once
// Contacts of a rank's part of a line: their places, and answers to forces there (influence
// functions, columns of A^-1).
#include "base/arrays.hpp"
#include "contact/touch.hpp"
#include "motion/motion.hpp"

namespace catenary {

/// Contact wires: their nodes, wire by wire, and samples of their running surfaces, ascending in
/// each wire, none of a wire that has none.
struct Wires {
    std::span<const Node> nodes;
    std::span<const Sample> surface;
    CATENARY_RECORD(nodes, surface)
};

/// Accelerations of the line by a unit force at each of n contacts (n, n_local), and their
/// derivatives along the track, without columns where no law needs rates.
struct Answers {
    Array2<double> by_force, slope;
    CATENARY_RECORD(by_force, slope)
    CATENARY_SHAPES("n k, n k?")
};

/// Gains of answers within a step.
struct Gains {
    double train_speed;         ///< V of the convective part of rates [m/s]
    double position, velocity;  ///< of an acceleration [s2], [s]
    double reach;               ///< how far off links answer to a force [m]
    CATENARY_RECORD(train_speed, position, velocity, reach)
};

/// Links that a rank follows, in the order along the track.
struct Followed {
    std::span<const int64_t> numbers;  ///< in the line
    Links links;
    std::span<const double> reserve;  ///< as a free step leaves it [N]
    std::span<const int64_t>
        moving;  ///< (2,) the first that may switch, and the one after the last
    Dependents dependents;
    std::span<const int64_t> dependent_numbers;  ///< numbers of the dependents
    CATENARY_RECORD(numbers, links, reserve, moving, dependents, dependent_numbers)
    CATENARY_SHAPES("n, n=n, n, 2, n=n, *")
};

/// Columns of A^-1 for compensations of all links of the line: that of link d is of the local
/// unknowns from start[d] on, width[d] numbers of `data` from at[d] on.
struct LinkColumns {
    std::span<const int64_t> start, at, width;
    std::span<const double> data;
    CATENARY_RECORD(start, at, width, data)
    CATENARY_SHAPES("n, n, n")
};

/// Work of n contact forces on the line, summed step by step. With load vectors b of unit forces at
/// the contacts, velocities v and shares p, q a step h adds
///
///     h (p f_n b_n + q f_n+1 b_n+1) . (v_n + v_n+1) / 2,
///
/// the work of the discrete motion by average acceleration.
struct ContactWork {
    std::span<double> total;           ///< (1,) [J], by the wires' unknowns that this rank owns
    std::span<double> force;           ///< after the step before [N]
    Array2<int64_t> local;             ///< (n, 4) of the contacts then, and
    Array2<double> value;              ///< their functions
    std::span<double> before;          ///< b_n . v_n [m/s]
    std::span<double> ahead;           ///< b_n+1 . v_n [m/s]
    double share_before, share_after;  ///< p, q
    double dt;                         ///< h [s]
    CATENARY_RECORD(total, force, local, value, before, ahead, share_before, share_after, dt)
    CATENARY_SHAPES("1, n, n 4, n 4, n, n")
};

/// Unknowns (v, theta_z) of the contact wires' nodes (n_nodes, 2): numbers on this rank, 0 where
/// another one owns them; whether this one does; lateral places [m] and slopes [-] at rest. Without
/// rows where no lateral motion is simulated.
struct Sideways {
    Array2<const int64_t> local;
    Array2<const bool> owned;
    Array2<const double> rest;
    CATENARY_RECORD(local, owned, rest)
    CATENARY_SHAPES("n 2, n 2, n 2")
};

/// All that n contacts of a rank work on.
struct Contacts {
    std::span<const double> x;  ///< where they are along the track [m]
    std::span<Touch> touches;
    Wires wires;
    std::span<const double> columns;  ///< of A^-1 for the nodes, see `Node`
    Answers answers;
    Gains gains;
    Motion motion;
    std::span<const double> motion_gains;  ///< (3,) of x, y, z, of a unit of acceleration
    Followed followed;
    LinkColumns link_columns;
    ContactWork work;
    Sideways sideways;
    Across across;
    CATENARY_RECORD(x, touches, wires, columns, answers, gains, motion, motion_gains, followed,
                    link_columns, work, sideways, across)
    CATENARY_SHAPES("n, n, *, *, n=n, *, *, 3, *, *, n=n, *, n=n?")
};

/// Locate the `touches` at places `x` (n,) [m], each on its own wire. A node belongs to the element
/// that it ends.
void locate(std::span<const double> x, const Wires& wires, std::span<Touch> touches);
/// Locate the touches at the places of the contacts, and fill in the answers to forces there.
void place(const Contacts& contacts);
/// Fill in the owned share of the wire's height [m] and of its total rate dw/dt + V dw/dx [m/s] at
/// each contact.
void heights(const Contacts& contacts, std::span<double> height, std::span<double> rate);
/// Fill in this rank's share of where wires are across the track; zero where they are on no strip.
void find_across(const Contacts& contacts);

/// Add the answers to contact forces (n,) [N] to the motion.
void superpose(const Contacts& contacts, std::span<const double> force);
/// Add the answers to compensations [N] of links with these numbers.
void compensate(const Contacts& contacts, std::span<const int64_t> numbers,
                std::span<const double> compensation);
/// Keep the velocities at the coming step's contacts, before the step.
void begin_work(const Contacts& contacts);
/// Add the work that contact forces (n,) [N] have done in the step which has ended. The wire's own
/// velocity counts, without the convective part: the train pays for that part.
void add_work(const Contacts& contacts, std::span<const double> force);

}  // namespace catenary
