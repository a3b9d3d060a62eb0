#pragma once
// Contacts of a rank's part of a line: places of strips on contact wires, answers to forces there
// (influence functions, columns of A^-1, which vanish outside of windows), and outputs of
// pantographs and strips.
#include "base/arrays.hpp"
#include "motion/motion.hpp"

namespace catenary {

/// Far more than the round-off of a position, far less than an element [m].
inline constexpr double kSlip = 1e-6;

/// A node of a contact wire. As short as can be, since a line has very many.
struct Node {
    double x, y;       ///< along the track and across it [m]
    double rest[2];    ///< its unknowns (w, theta_y) at rest [m], [-]
    int64_t at;        ///< where its columns of A^-1 for both begin, one after the other
    int32_t begin;     ///< the first local unknown of both columns
    int32_t width;     ///< how long each of them is
    int32_t local[2];  ///< numbers of its unknowns on this rank, 0 where another one owns them
    int8_t owned[2];   ///< whether this rank does
    int8_t joined;     ///< whether an element joins it to the next one
};

/// A sample of the running surface of a contact wire.
struct Sample {
    double x, height, slope;  ///< along the track [m], above the wire's axis [m], [-]
};

/// A place of a strip on a contact wire, which is a candidate for a contact.
struct Touch {
    int64_t first, end;  ///< the wire's first node, and the one after its last
    double half_length;  ///< of the strip [m]
    double present;      ///< 1 if the wire is there on the strip, else 0: so are all functions then
    double x;            ///< along the track [m]
    int64_t element;     ///< first node of its element
    int64_t local[4];    ///< numbers of the element's unknowns on this rank, 0 where not owned
    double value[4];     ///< Hermite functions N of them, 0 where not owned
    double slope[4];     ///< dN/dx [1/m], 0 where not owned
    double whole_value[4];  ///< N and dN/dx without regard to owners
    double whole_slope[4];
    double rest[4];      ///< the unknowns at rest [m], [-]
    int64_t samples[2];  ///< first sample of the wire's running surface, and the one after its last
    int64_t sample;      ///< the sample before the place
    double surface[2];   ///< height [m] and slope [-] of the running surface here
    int64_t filled[2];  ///< first and one after the last local unknown that answers to a force here
};

/// Lateral motion of wires at n contacts: place y + v [m], its total rate
/// dv/dt + V (dy/dx + dv/dx) [m/s] and displacement v [m]. Empty without lateral motion.
struct Across {
    std::span<double> place, rate, moved;
    CATENARY_RECORD(place, rate, moved)
    CATENARY_SHAPES("n, n, n")
};

/// Heights and their rates at n contacts: `place` (n,) [m] and `rate` (n,) [m/s] without forces,
/// `by_force` (n, n) [m/N] and `rate_by_force` (n, n) [m/(N s)]: their increase by forces
/// for a line, their decrease for heads and depths.
struct Affine {
    std::span<double> place, rate;
    Array2<double> by_force, rate_by_force;
    CATENARY_RECORD(place, rate, by_force, rate_by_force)
    CATENARY_SHAPES("n, n, n n, n n")
};

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
/// The same for other motions of the line side by side: forces (n, L) and compensations (m, L) in
/// all of their lanes.
void superpose(const Contacts& contacts, Array2<const double> forces, const Motion& motion);
void compensate(const Contacts& contacts, std::span<const int64_t> numbers,
                Array2<const double> compensations, const Motion& motion);
/// Keep the velocities at the coming step's contacts, before the step.
void begin_work(const Contacts& contacts);
/// Add the work that contact forces (n,) [N] have done in the step which has ended. The wire's own
/// velocity counts, without the convective part: the train pays for that part.
void add_work(const Contacts& contacts, std::span<const double> force);

/// First contact of each strip, first strip of each pantograph, and the number of all at the end:
/// (n_strips + 1,), (n_pantographs + 1,).
struct StripEnds {
    std::span<const int64_t> of_strip, of_pantograph;
    CATENARY_RECORD(of_strip, of_pantograph)
    CATENARY_SHAPES("s+1, p+1")
};

/// Contact force [N], head height and wire height [m] of each pantograph, the force of each strip,
/// and, of several contact wires, that on each wire from each pantograph [N], pantograph by
/// pantograph; empty of a single one.
struct TrainOutputs {
    StripEnds ends;
    std::span<double> contact_force, head_height, wire_height, strip_force, contact_wire_force;
    CATENARY_RECORD(ends, contact_force, head_height, wire_height, strip_force, contact_wire_force)
    CATENARY_SHAPES("s=s p=p, p, p, p, s, *")
};

/// Fill in the outputs from n contacts: `force` (n,) and `reported` force (n,) [N], `heads` as
/// functions of forces, `depth` (n,) [m]. A pantograph's force is the sum over its contacts,
/// heights are means over its strips; of several wires over a strip the lowest counts.
void write_outputs(const TrainOutputs& outputs, std::span<const double> force,
                   std::span<const double> reported, const Affine& heads,
                   std::span<const double> depth);

/// How far contacts of m raked strips are ahead of the strip's middle, straight between points.
struct Leads {
    std::span<const int64_t> contact;  ///< (m,) numbers of the contacts
    std::span<const int64_t> first;    ///< (m + 1,) where the points of each begin
    std::span<const double> middle;    ///< of the strip along the track [m], ascending for each
    std::span<const double> lead;      ///< how far the contact is ahead of it [m]
    CATENARY_RECORD(contact, first, middle, lead)
    CATENARY_SHAPES("m, m+1, k, k")
};

/// Contacts and then pantographs along the track [m]: at the start, now.
struct TrainPlaces {
    std::span<const double> start;
    std::span<double> now;
    Leads leads;
    CATENARY_RECORD(start, now, leads)
    CATENARY_SHAPES("n, n")
};

/// Move all a way [m] ahead of where they started.
void move_contacts(const TrainPlaces& places, double way);

}  // namespace catenary
