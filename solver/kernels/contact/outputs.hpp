#pragma once
// Places of contacts along the track, and outputs of pantographs and strips.
#include "base/arrays.hpp"
#include "contact/touch.hpp"

namespace catenary {

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
