#pragma once
// Free steps of a rank's part of a line in two passes, with reserves of links found on the way back
// and a window of moving stations that follows the train. Stations outside of it are at rest: no
// step reads or writes them, but for the ones beside it, which are held where they are. See
// stations/line.hpp for the passes.
#include <optional>

#include "motion/motion.hpp"
#include "stations/elimination.hpp"
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

    /// Call `find(begin, end)` for the links on both sides that stretch `number` leaves behind.
    template <class Find>
    void behind(int64_t number, const Find& find) const {
        part(ranges.all(), 2 * number, 2 * number + 4);
        find(ranges(number + 1, 0), ranges(number, 0));
        find(ranges(number, 1), ranges(number + 1, 1));
    }
};

struct WindowState {
    int64_t step;      ///< steps taken
    int64_t is_fresh;  ///< whether the whole line is still alive
};

struct Window {
    std::span<int64_t> state;  ///< of `WindowState`
    int64_t every, guard;      ///< steps between two updates, and stations that are tested at one
    /// Share of the largest motion below which stations rest, 0 if spans decide; these spans.
    double by_motion, spans_behind, spans_ahead;
    double fading;                      ///< how much fades at an update [m2], see `fade`
    bool is_exact;                      ///< whether stations at rest are zeroed, or stay in place
    std::span<double> peak;             ///< largest of x and y of the motion
    std::span<const double> contacts;   ///< where they are [m]
    std::span<const double> loaded;     ///< first and last place with a load [m]
    double margin;                      ///< reach of a step and of links that switch in it [m]
    std::span<const double> masts;      ///< where spans end [m]
    std::span<const double> low, high;  ///< where stations begin and end [m]
    std::span<const int64_t> starts;    ///< (n + 1,) first unknown of each
    std::span<const int64_t> links_before;  ///< (n + 1,) how many links stand before each
    std::span<int64_t> ends;                ///< of `Ends`
    std::span<int32_t> kinds;               ///< of factors
    Turning turning;
    std::span<int64_t> links;  ///< the first link that may switch and the one after the last
    Array2<int64_t> ranges;    ///< (2, 2) the same for the pass back, see `TrackedLinks`
    std::span<double> known;   ///< known accelerations beside x, y and z, if the motion has them
    CATENARY_RECORD(state, every, guard, by_motion, spans_behind, spans_ahead, fading, is_exact,
                    peak, contacts, loaded, margin, masts, low, high, starts, links_before, ends,
                    kinds, turning, links, ranges, known)
    CATENARY_SHAPES("2, *, *, *, *, *, *, *, 2, *, 2, *, *, n, n, n+1, n+1, 5, *, *, 2, 2 2, *")

    int64_t n_stations() const { return size(low); }
    Ends& at() const { return *reinterpret_cast<Ends*>(ends.data()); }
};

/// Stations of the smallest window.
constexpr int64_t kLeastStations = 64;

/// Move the window after contacts and motion, at some steps; whether it was the first update.
bool update(const Window& window, const Motion& motion);
/// Make the window the stations from `begin` to `end`, and the links that may switch those in it.
void turn_to(const Window& window, int64_t begin, int64_t end);

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
