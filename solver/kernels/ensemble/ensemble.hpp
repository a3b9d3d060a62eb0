#pragma once
// Marches of several scenes that share a line, its matrices and factors, side by side.
//
// Numbers of an unknown in all scenes follow each other, so that a number of a matrix is read once
// for all of them: a step of one scene waits for memory and broadcasts.
#include "motion/two_passes.hpp"
#include "steps/steps.hpp"

namespace catenary {

/// Extremes of a line's outputs in several scenes since each of them began.
struct LineExtremes {
    std::span<const int64_t> arms;  ///< unknowns of vertical displacement at steady arms
    Links droppers;
    Array2<const double> rest;      ///< (n_droppers, n) their reserves at rest [N]
    Array2<double> uplift;          ///< (n_arms, n) largest displacement [m]
    Array2<double> least, largest;  ///< (n_droppers, n) forces [N]
    CATENARY_RECORD(arms, droppers, rest, uplift, least, largest)
    CATENARY_SHAPES("a, n=d, d l, a l, d l, d l")
};

class ScenePasses : private Around {
  public:
    /// Arrays of `parts` are for n scenes, `kScenes` or `kMostScenes`, which the spacing of the
    /// motion is. Throws std::invalid_argument as `PassLine`, or if the method is not Newmark's.
    explicit ScenePasses(PassParts parts);
    int64_t n() const { return parts_.arrays.motion.spacing; }

    /// Fill the reserves (n,) of links in each scene in a free step; `tracked` as for one scene,
    /// but that links have other reserves at rest (n_links, n) [N].
    void track(const TrackedLinks& tracked, Array2<const double> rest,
               std::vector<std::span<double>> reserves);
    /// Make room for the reserves of so many links.
    void make_room(size_t n_links);
    void step();
    /// Take the present motion into the extremes of scenes for which `none` (n,) is 0, not of those
    /// for which it is infinite.
    void take(const LineExtremes& extremes, std::span<const double> none);
    /// Put a scene's line at rest.
    void rest(int64_t scene) const;

  private:
    void before() override { n_followed_ = 0; }
    void after_stretch() override;

    PassParts parts_;
    PassLine line_;
    TrackedLinks tracked_{};
    Array2<const double> rest_{};
    std::vector<std::span<double>> reserves_;
    std::vector<double> found_;  ///< room for reserves in all scenes
    int64_t n_followed_ = 0;
};

/// A scene on its way: its steps, the next of its block and the end of it.
struct March {
    std::shared_ptr<Steps> steps;  ///< none where no scene is
    int64_t next = 0, end = 0;
    bool is_left = false;  ///< whether the forces of a step were not found; it stays then
};

class Ensemble {
  public:
    Ensemble(std::shared_ptr<ScenePasses> passes, LineExtremes extremes);
    virtual ~Ensemble() = default;

    /// Begin a scene in a lane, whose line is at rest, with n steps of its block.
    void begin(int64_t lane, std::shared_ptr<Steps> steps, int64_t n);
    /// Take steps until a scene is at its end, or left, or until so many were taken.
    void take(int64_t most);
    const March& at(int64_t lane) const { return marches_.at(lane); }

  private:
    bool goes_on(const March& march) const {
        return march.steps && !march.is_left && march.next < march.end;
    }

    std::shared_ptr<ScenePasses> passes_;
    LineExtremes extremes_;
    std::vector<March> marches_;  ///< in all lanes
    std::vector<double> none_;    ///< of each lane 0 if it goes on, else infinite
};

}  // namespace catenary
