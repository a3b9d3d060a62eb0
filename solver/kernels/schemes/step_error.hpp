#pragma once
// Error of the contact forces by one step. See step_error.py for the equation.
#include "base/arrays.hpp"
#include "base/record.hpp"

namespace catenary {

/// The latest steps, oldest first, of n contacts.
struct PastSteps {
    std::span<double> times;   ///< (3,) their ends [s]
    Array2<double> depths;     ///< (3, n) [m]
    std::span<double> forces;  ///< (n,) at the end of the last [N]
    CATENARY_RECORD(times, depths, forces)
    CATENARY_SHAPES("3, 3 n, n")
};

/// A step that is judged, (n,) each.
struct TriedStep {
    std::span<const double> depth, force;  ///< [m], [N]
    std::span<const double> stiffness;     ///< of the law's tangent [N/m]
    std::span<const double> compliance;    ///< decrease of depth in the step by a unit force [m/N]
    CATENARY_RECORD(depth, force, stiffness, compliance)
    CATENARY_SHAPES("n, n, n, n")
};

/// Largest error of a contact force by a step to `time` [N].
double step_error(const TriedStep& tried, const PastSteps& past, double time);
/// Append a step to `time` to the past steps and drop the oldest.
void accept_step(const TriedStep& tried, const PastSteps& past, double time);

}  // namespace catenary
