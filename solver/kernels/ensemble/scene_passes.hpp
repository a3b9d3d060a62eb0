#pragma once
// Free steps of a line in several scenes side by side, which share its matrices and factors.
//
// Numbers of an unknown in all scenes follow each other, so that a number of a matrix is read once
// for `kScenes` of them: a step of one scene waits for memory and broadcasts.
#include <array>

#include "motion/two_passes.hpp"

namespace catenary {

/// Extremes of a line's outputs in several scenes since each of them began.
struct LineExtremes {
    std::span<const int64_t> arms;  ///< unknowns of vertical displacement at steady arms
    Links droppers;
    Array2<const double> rest;      ///< (n_droppers, kScenes) their reserves at rest [N]
    Array2<double> uplift;          ///< (n_arms, kScenes) largest displacement [m]
    Array2<double> least, largest;  ///< (n_droppers, kScenes) forces [N]
    CATENARY_RECORD(arms, droppers, rest, uplift, least, largest)
    CATENARY_SHAPES("a, n=d, d 4, a 4, d 4, d 4")
};

class ScenePasses : private Around {
  public:
    /// Arrays of `parts` are for all scenes. Throws std::invalid_argument as `PassLine`, or if the
    /// method is not Newmark's.
    explicit ScenePasses(PassParts parts);

    /// Fill the reserves (n,) of links in each scene in a free step; `tracked` as for one scene,
    /// but that links have other reserves at rest (n, kScenes) [N].
    void track(const TrackedLinks& tracked, Array2<const double> rest,
               std::vector<std::span<double>> reserves);
    /// Make room for the reserves of so many links.
    void make_room(size_t n_links);
    void step();
    /// Take the present motion into the extremes of scenes with `moves`.
    void take(const LineExtremes& extremes, const std::array<bool, kScenes>& moves);
    /// Put a scene's line at rest.
    void rest(int scene) const;

  private:
    void before() override { n_followed_ = 0; }
    void after_stretch() override;
    void find_reserves(int64_t begin, int64_t end);

    PassParts parts_;
    PassLine line_;
    TrackedLinks tracked_{};
    Array2<const double> rest_{};
    std::vector<std::span<double>> reserves_;
    std::vector<double> found_;  ///< room for reserves in all scenes
    int64_t n_followed_ = 0;
};

}  // namespace catenary
