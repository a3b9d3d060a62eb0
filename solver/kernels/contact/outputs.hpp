#pragma once
// What a step shows of pantographs and strips.
#include "contact/affine.hpp"

namespace catenary {

/// Which contacts a strip has, and which strips a pantograph: numbers of the first ones, and of
/// all; (n_strips + 1,), (n_pantographs + 1,).
struct StripEnds {
    std::span<const int64_t> of_strip, of_pantograph;
    CATENARY_RECORD(of_strip, of_pantograph)
};

/// Contact force [N], head height and wire height [m] of each pantograph, the force of each strip,
/// and, of several contact wires, that on each wire from each pantograph [N], pantograph by
/// pantograph; empty of a single one.
struct TrainOutputs {
    StripEnds ends;
    std::span<double> contact_force, head_height, wire_height, strip_force, contact_wire_force;
    CATENARY_RECORD(ends, contact_force, head_height, wire_height, strip_force, contact_wire_force)
};

/// Fill in the outputs of n contacts: `force` (n,) [N], what of it is `reported` (n,), `heads` as
/// functions of forces, `depth` (n,) [m]. A pantograph's force is the sum over its contacts,
/// heights are means over its strips; of several wires over a strip the lowest counts.
void write_outputs(const TrainOutputs& outputs, std::span<const double> force,
                   std::span<const double> reported, const Affine& heads,
                   std::span<const double> depth);

}  // namespace catenary
