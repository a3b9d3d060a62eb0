#pragma once
// Motions of the line in several tangents, which step side by side: free steps, of the stations
// that move in one of them.
//
// Where a march begins, all tangents are at rest. A force moves the stations within its reach, all
// others by less than round-off, and waves carry the motion on. So the stations that move are a
// range, which grows: by those that a force moves, and by those next to outer ones that have begun
// to move. What a step leaves out is held at rest. Elimination goes through this range alone: its
// right-hand sides beyond are zero, and it ends at the station where it does on the whole line, or
// else at the nearest one that moves.
#include "contact/contacts.hpp"
#include "motion/two_passes.hpp"

namespace catenary {

class LanePasses : private Around {
  public:
    /// `guard` outer stations of those that move are looked at; all move from the start on if it
    /// is 0. Throws std::invalid_argument as `PassLine`, or if the line goes on at another rank.
    LanePasses(PassParts parts, int64_t guard);

    /// Let the stations of unknowns from `begin` to `end` move.
    void wake(int64_t begin, int64_t end);
    /// Let further stations move if outer ones do, in the tangents or in the march itself if it
    /// loads them. To be called before each step; looks at some.
    void follow(const Motion* march);
    void step();
    /// The first unknown that moves and the one after the last.
    int64_t begin() const { return starts_[ends_.begin]; }
    int64_t end() const { return starts_[ends_.end]; }

  private:
    void before() override {}
    void after_stretch() override {}
    int64_t n_stations() const { return size(starts_) - 1; }
    void move(int64_t begin, int64_t end);

    PassParts parts_;
    PassLine line_;
    std::vector<int64_t> starts_;  ///< (n + 1,) first unknown of each station
    int64_t guard_;
    int64_t middle_;  ///< where elimination ends on the whole line
    Ends ends_;
    int64_t n_followed_ = 0;
    std::vector<double> own_, of_march_;  ///< largest motions, see `find_peak`
};

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

}  // namespace catenary
