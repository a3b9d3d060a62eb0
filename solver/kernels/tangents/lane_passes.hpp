#pragma once
// Free steps of the line in several tangents side by side, of the stations that move in one of
// them.
//
// Where a march begins, all tangents are at rest. A force moves the stations within its reach, all
// others by less than round-off, and waves carry the motion on. So the stations that move are a
// range, which grows: by those that a force moves, and by those next to outer ones that have begun
// to move. What a step leaves out is held at rest. Elimination goes through this range alone: its
// right-hand sides beyond are zero, and it ends at the station where it does on the whole line, or
// else at the nearest one that moves.
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

}  // namespace catenary
