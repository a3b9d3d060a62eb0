#pragma once
// A window of moving stations that follows the train. Stations outside of it are at rest: no step
// reads or writes them, but for the ones beside it, which are held where they are.
#include "motion/motion.hpp"
#include "stations/elimination.hpp"
#include "stations/line.hpp"

namespace catenary {

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

}  // namespace catenary
