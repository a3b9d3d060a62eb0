#pragma once
// Motions of the line in several tangents, which step side by side.
#include "contact/contacts.hpp"
#include "tangents/lane_passes.hpp"

namespace catenary {

/// Derivatives of the line's matrices by the parameters of L lanes, which are multiplied with the
/// march's motion.
///
/// Rows stand in pairs 2 p and 2 p + 1: deflection and rotation of a node. Nodes of a wire are in
/// runs. Such a node has the entries of a beam at its own unknowns and at those of the nodes beside
/// it, multiplied with a sum of x, y and z by the weights of its term. Between equal elements they
/// are even about it, so that six numbers a lane are all of them. Where a dropper hangs, rows have
/// further entries, each with its own numbers for x, y and z.
struct ChangedRows {
    /// Nodes at equal distances; one alone between different elements.
    struct Run {
        int64_t before, first, after;  ///< pairs of its first node, and beside both ends
        int64_t n, step;               ///< of nodes, and pairs from one to the next
        int64_t numbers;               ///< the first one's place; of a pair that is no node -1
        int64_t is_even;               ///< and has six numbers, see `multiply`, else twelve
        int64_t term;                  ///< of `weights`
    };
    Array2<const double> weights;    ///< (n_terms, 3 L) of x, y and z in sums
    Array2<const int64_t> parts;     ///< (n_parts + 1, 2) where its `runs` and `rows` begin
    Array2<const int64_t> runs;      ///< (n, 8) see `Run`
    Array2<const double> numbers;    ///< (n, L) of the nodes of runs
    Array2<const int64_t> rows;      ///< (n, 2) with further entries: number and kind
    std::span<const int64_t> begin;  ///< (n + 1,) of kinds in `ahead` and `further`
    std::span<const int64_t> ahead;  ///< (n,) from the row to the unknown
    Array2<const double> further;    ///< (n, 3 L)
    int64_t part;                    ///< pairs in each part of the line, the last may have fewer
    CATENARY_RECORD(weights, parts, runs, numbers, rows, begin, ahead, further, part)
    CATENARY_SHAPES("* *, * 2, * 8, * *, * 2, *, k, k *")
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
