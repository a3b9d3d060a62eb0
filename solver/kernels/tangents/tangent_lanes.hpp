#pragma once
// Motions of the line in several tangents, which step side by side.
#include "contact/contacts.hpp"
#include "tangents/lane_passes.hpp"

namespace catenary {

/// Sums of the march's x, y and z in L lanes, with weights of their own: (L,) for each of the
/// three. Those with the first weights are at all unknowns; behind them
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
    int64_t reach;                ///< how far from a pair the sums at all unknowns are read
    CATENARY_RECORD(sums, kinds, begin, offsets, values, reach)
};

/// Motions of the line in L tangents: the numbers of an unknown in all of them follow each other.
struct TangentLanes {
    LanePasses* passes;       ///< take the step without forces
    Motion motion;            ///< of all lanes; L is its spacing: 1, `kScenes` or `kMostScenes`
    std::span<double> loads;  ///< that a step reads, of whole pairs; none if nothing loads the line
    ChangedRows rows;
    CATENARY_RECORD(passes, motion, loads, rows)

    int64_t n() const { return motion.spacing; }
    /// The motion in one lane.
    Motion at(int64_t lane) const {
        return {motion.x.subspan(lane), motion.y.subspan(lane), motion.z.subspan(lane),
                motion.shares, motion.spacing};
    }
};

/// Put the loads of all unknowns that move: minus the products of changed matrices with the march's
/// motion.
void load(const TangentLanes& lanes, const Motion& march);
/// Add the answers to contact forces (n_contacts, L) [N] to the motions.
void superpose(const Contacts& contacts, Array2<double> forces, const TangentLanes& lanes);
/// Add the answers to forces (n, L) [N] of links with these numbers, which are minus their
/// compensations.
void compensate(const Contacts& contacts, std::span<const int64_t> numbers, Array2<double> forces,
                const TangentLanes& lanes);

}  // namespace catenary
