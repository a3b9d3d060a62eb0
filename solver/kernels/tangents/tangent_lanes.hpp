#pragma once
// Motions of the line in several tangents, which step side by side.
#include "contact/contacts.hpp"
#include "ensemble/scene_passes.hpp"

namespace catenary {

/// Sums of the march's displacement, velocity and acceleration in L lanes, with weights of their
/// own: (L,) for each of the three. Those with the first weights are at all unknowns; behind them
/// stand those with weights[i] at the unknowns from begin[i - 1] to begin[i].
struct LaneSums {
    Array2<const double> weights;
    std::span<const int64_t> begin, unknowns;
    std::span<double> numbers;  ///< room for the sums
    CATENARY_RECORD(weights, begin, unknowns, numbers)
};

/// Derivatives of the line's matrices by the parameters of L lanes, in pairs of rows: of all rows
/// 2 p and 2 p + 1 the kind. Pairs of a kind have the same numbers, from begin[kind] to
/// begin[kind + 1]; each is multiplied with the sums that stand `offset` behind number 2 p.
struct ChangedRows {
    LaneSums sums;
    std::span<const int32_t> kinds;
    std::span<const int64_t> begin;
    std::span<const int32_t> offsets;
    Array2<const double> values;  ///< (n, 2 L) of the one row in all lanes, then of the other
    int64_t ahead;                ///< how far behind a row the sums at all unknowns are read
    CATENARY_RECORD(sums, kinds, begin, offsets, values, ahead)
};

/// The march's motion at the end of a step, (n_local,) each.
struct LineMotion {
    std::span<const double> displacement, velocity, acceleration;
};

/// Motions of the line in L tangents: the numbers of an unknown in all of them follow each other.
struct TangentLanes {
    TwoPasses* alone;         ///< takes the step of a single one without forces; or null
    ScenePasses* together;    ///< that of `kScenes`; or null
    Motion motion;            ///< of all lanes; L is its spacing
    std::span<double> loads;  ///< that a step reads, of whole pairs; none if nothing loads the line
    ChangedRows rows;
    CATENARY_RECORD(alone, together, motion, loads, rows)

    int64_t n() const { return motion.spacing; }
    /// The motion in one lane.
    Motion at(int64_t lane) const {
        return {motion.x.subspan(lane), motion.y.subspan(lane), motion.z.subspan(lane),
                motion.shares, motion.spacing};
    }
};

/// Take the step without forces.
void take_free_step(const TangentLanes& lanes);
/// Put all loads: minus the products of changed matrices with the march's motion.
void load(const TangentLanes& lanes, const LineMotion& motion);
/// Add the answers to contact forces (n_contacts, L) [N] to the motions.
void superpose(const Contacts& contacts, Array2<double> forces, const TangentLanes& lanes);
/// Add the answers to forces (n, L) [N] of links with these numbers, which are minus their
/// compensations.
void compensate(const Contacts& contacts, std::span<const int64_t> numbers, Array2<double> forces,
                const TangentLanes& lanes);

}  // namespace catenary
