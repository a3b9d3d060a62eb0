#pragma once
// How wrong a step makes the contact forces. See step_error.py for the equation.
#include "base/arrays.hpp"
#include "base/record.hpp"

namespace catenary {

/// The latest steps, oldest first, of n contacts.
struct PastSteps {
    std::span<double> times;   ///< (3,) their ends [s]
    Array2<double> depths;     ///< (3, n) [m]
    std::span<double> forces;  ///< (n,) at the end of the last [N]
    CATENARY_RECORD(times, depths, forces)
};

/// A step that is judged, (n,) each.
struct TriedStep {
    std::span<const double> depth, force;  ///< [m], [N]
    std::span<const double> stiffness;     ///< of the law's tangent [N/m]
    std::span<const double> compliance;    ///< what a force takes off the depth within it [m/N]
    CATENARY_RECORD(depth, force, stiffness, compliance)
};

/// Largest error of a contact force by a step to `time` [N].
double step_error(const TriedStep& tried, const PastSteps& past, double time);
/// Append a step to `time` to those of the past and drop the oldest.
void accept_step(const TriedStep& tried, const PastSteps& past, double time);

}  // namespace catenary
