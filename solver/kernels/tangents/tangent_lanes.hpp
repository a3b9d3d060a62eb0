#pragma once
// Motions of the line in several tangents, which step side by side.
#include "contact/contacts.hpp"
#include "tangents/lane_passes.hpp"

namespace catenary {

/// Derivatives of the line's matrices by the parameters of L lanes, which are multiplied with sums
/// of the march's x, y and z. A lane has up to n_terms matrices, each with sums by weights of its
/// own.
///
/// Rows stand in pairs: of rows 2 p and 2 p + 1 the kind. Pairs of a kind have the same numbers,
/// from begin[kind] to begin[kind + 1]; each is multiplied with the sums that stand `offset`
/// unknowns behind unknown 2 p, where those of the next term stand `room` behind.
struct ChangedRows {
    Array2<const double> weights;  ///< (n_terms, 3 L) of x, y and z
    std::span<const int32_t> kinds;
    std::span<const int64_t> begin;
    std::span<const int32_t> offsets;
    Array2<const double> values;  ///< (n, 2 L) of the one row in all lanes, then of the other
    int64_t reach;                ///< how far from unknown 2 p sums are read
    int64_t room;                 ///< for sums of a term near the pairs that are taken at a time
    std::span<double> sums;       ///< (n_terms * room * L)
    CATENARY_RECORD(weights, kinds, begin, offsets, values, reach, room, sums)
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
