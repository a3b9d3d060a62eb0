#pragma once
// Marches of several scenes that share a line, side by side.
#include "ensemble/scene_passes.hpp"
#include "steps/steps.hpp"

namespace catenary {

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
