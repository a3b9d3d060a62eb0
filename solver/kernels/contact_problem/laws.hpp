#pragma once
// Contact laws: tangents, and what is reported of forces.
#include "base/arrays.hpp"
#include "base/record.hpp"

namespace catenary {

/// own f = offset + by_depth d + by_rate d' at n contacts, with depth d and rate d' of the gap
/// under forces f; (n,) each [-], [N], [N/m], [N s/m].
struct Tangents {
    std::span<double> own, offset, by_depth, by_rate;
    CATENARY_RECORD(own, offset, by_depth, by_rate)
};

/// f = K d^n (1 + chi d' / d0') with the rate d0' at which the gap closed.
struct HertzLaw {
    double stiffness, exponent, hysteresis;  ///< K [N/m^n], n, chi
    CATENARY_RECORD(stiffness, exponent, hysteresis)
};
/// Fill in the tangents at depths [m] and rates [m/s], and the forces there [N]; (n,) each, with
/// the rates `speed` at which gaps closed.
void linearise(const HertzLaw& law, std::span<const double> depth, std::span<const double> rate,
               std::span<const double> speed, const Tangents& tangents, std::span<double> force);

/// Which forces of n contacts are reported at the end of a step.
struct ReportedForces {
    double gamma;                ///< weight of the new force in what is reported; 0 reports itself
    double from_time;            ///< from which on a reported force that pulls ends the run [s]
    std::span<double> latest;    ///< forces of the latest step [N], (n,) if gamma is not 0
    std::span<double> reported;  ///< what is reported of it (n,) [N]
    CATENARY_RECORD(gamma, from_time, latest, reported)
};
/// Whether the contact law holds for forces (n,) at `time` [s]; if so they are remembered. A law
/// with gamma > 0 reports their mean over the step.
bool report(double time, std::span<const double> force, const ReportedForces& law);

}  // namespace catenary
