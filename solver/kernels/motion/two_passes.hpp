#pragma once
// Free steps of a rank's part of a line in two passes, with reserves of links found on the way back
// and a window that follows the train. See stations/line.hpp for the passes.
#include <optional>

#include "motion/motion.hpp"
#include "motion/window.hpp"
#include "stations/line.hpp"

namespace catenary {

/// Arrays that both passes read and fill.
struct PassArrays {
    std::span<double> factor;            ///< operand of products with K, see `ProductArrays`
    std::span<double> velocity;          ///< the same of products with C; may be empty
    std::span<const double> loads;       ///< [N] of all that is solved for; may be empty
    std::span<double> answer;            ///< accelerations of all that is solved for
    Motion motion;                       ///< of the rank's own unknowns
    std::span<double> known, predicted;  ///< known accelerations, predicted velocities, or empty
    CATENARY_RECORD(factor, velocity, loads, answer, motion, known, predicted)
};

/// A line of stations with the arrays of its steps.
struct PassParts {
    std::vector<std::pair<Layout, Layout>> layouts;  ///< of rows and factors, for each station type
    std::vector<std::vector<int>> station_types;     ///< see `Line`
    ProductArrays rows;
    FactorArrays factors;
    PassArrays arrays;
    Changes changes;
    CATENARY_RECORD(layouts, station_types, rows, factors, arrays, changes)
};

/// A line with kernels that step so many scenes side by side, each with its part of the arrays, and
/// what its passes work on. Throws std::invalid_argument if none were compiled for a layout, or if
/// arrays have too few numbers.
struct PassLine {
    Line line;
    Work work;
    std::vector<uint8_t> even;  ///< see `Product`

    explicit PassLine(const PassParts& parts, int scenes = 1);
};

/// Links whose reserves are found on the way back, which is taken in stretches of so many pairs of
/// stations: `ranges` (n + 1, 2) are the links that it has left behind with each.
struct TrackedLinks {
    Links links;
    std::span<double> reserve;  ///< [N], filled
    Array2<const int64_t> ranges;
    int64_t stretch = 1;
    CATENARY_RECORD(links, reserve, ranges, stretch)
    CATENARY_SHAPES("n=n, n, r>1 2")
};

class TwoPasses : private Around {
  public:
    /// Throws std::invalid_argument as `PassLine`.
    explicit TwoPasses(PassParts parts);

    void track(const TrackedLinks& tracked) { tracked_ = tracked; }
    /// Take steps of the stations in a window only from now on.
    void open(const Window& window) { window_ = window; }
    /// Fill in the velocities that others read in products with C, if there are such.
    void predict_velocities() { predict_velocities(0, size(parts_.arrays.motion.x)); }
    void step();

    const PassParts& parts() const { return parts_; }
    const TrackedLinks& tracked() const { return tracked_; }
    const std::optional<Window>& window() const { return window_; }

  private:
    void before() override;
    void after_stretch() override;
    void predict_velocities(int64_t begin, int64_t end);

    PassParts parts_;
    PassLine line_;
    TrackedLinks tracked_{};
    int64_t n_followed_ = 0;
    std::optional<Window> window_;
};

}  // namespace catenary
