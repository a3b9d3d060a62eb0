#pragma once
// Laws that are not linear: tables that settle within a step. See mbs/head/laws.py.
#include <vector>

#include "heads/parts.hpp"

namespace catenary {

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
    /// Add the laws to a step's `force` (n,) and `matrix` (n, n), and invert the latter in place.
    ///
    /// Each law is taken along the segment of its table in which the step ends under the contact
    /// forces of the step before: first where the accelerations of the start lead to, then again
    /// until all segments stay.
    void settle(const StepStart& start, const NewmarkFactors& newmark, std::span<double> force,
                Array2<double> matrix);

  private:
    bool find_segments(const StepStart& start, const NewmarkFactors& newmark);
    void add(int64_t law, const StepStart& start, const NewmarkFactors& newmark,
             std::span<double> force, Array2<double> matrix) const;

    HeadLaws laws_;
    std::vector<double> plain_force_, plain_matrix_, acceleration_;
    std::vector<int64_t> segment_;
};

}  // namespace catenary
