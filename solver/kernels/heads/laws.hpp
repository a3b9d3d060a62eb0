#pragma once
// Laws that are not linear: tables that settle within a step. See mbs/head/laws.py.
#include <vector>

#include "base/arrays.hpp"
#include "heads/head.hpp"

namespace catenary {

/// A law's extension is way @ coordinates + by_base * base + by_roof * roof - zero; it pulls by a
/// table over this, or over its rate.
struct HeadLaw {
    double by_base;      ///< part of the base's height
    double by_roof;      ///< part of the roof's
    double zero;         ///< where extensions count from [m]
    int64_t of_rate;     ///< whether its points are rates
    int64_t begin, end;  ///< its points, two at least
};
struct HeadLawPoint {
    double at;     ///< [m] or [m/s]
    double force;  ///< [N]
};
/// m laws on n coordinates.
struct HeadLaws {
    Array2<const double> ways;  ///< (m, n)
    std::span<const HeadLaw> law;
    std::span<const HeadLawPoint> points;  ///< of all laws
    std::span<double> pressed;             ///< (s,) contact forces of the latest step [N]
    CATENARY_RECORD(ways, law, points, pressed)
    CATENARY_SHAPES("m n, m")
};

/// Start of a step: Newmark's predictors and the other variables of laws.
struct StepStart {
    std::span<const double> position, velocity;  ///< predicted (n,)
    std::span<const double> acceleration;        ///< of the state (n,)
    Array2<const double> touch;                  ///< (s, n), see `HeadArrays`
    double base, base_velocity;                  ///< [m], [m/s]
    double roof, roof_velocity;                  ///< [m], [m/s]
};

/// The laws of a head, with room to settle in.
class SettlingLaws {
  public:
    SettlingLaws(const HeadLaws& laws, int64_t n);
    bool any() const { return !laws_.law.empty(); }
    const HeadLaws& laws() const { return laws_; }
    /// Add the laws to a step's `force` (n,) and `matrix` (n, n), and invert the latter in place.
    ///
    /// Each law is taken along the segment of its table in which the step ends under the contact
    /// forces of the step before: first where the accelerations of the start lead to, then again
    /// until all segments stay.
    void settle(const StepStart& start, const NewmarkFactors& newmark, std::span<double> force,
                Array2<double> matrix);
    /// Remember contact forces (s,).
    void press(std::span<const double> contact_force);

  private:
    bool find_segments(const StepStart& start, const NewmarkFactors& newmark);
    void add(int64_t law, const StepStart& start, const NewmarkFactors& newmark,
             std::span<double> force, Array2<double> matrix) const;

    HeadLaws laws_;
    std::vector<double> plain_force_, plain_matrix_, acceleration_;
    std::vector<int64_t> segment_;
};

}  // namespace catenary
