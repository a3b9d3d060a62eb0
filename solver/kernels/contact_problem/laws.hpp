#pragma once
// Contact laws: tangents, and reported forces.
#include "base/arrays.hpp"

namespace catenary {

/// own f = offset + by_depth d + by_rate d' at n contacts, with depth d and rate d' of the gap
/// under forces f; (n,) each [-], [N], [N/m], [N s/m].
struct Tangents {
    std::span<double> own, offset, by_depth, by_rate;
    CATENARY_RECORD(own, offset, by_depth, by_rate)
    CATENARY_SHAPES("n, n, n, n")
};

/// f = K d^n (1 + chi d' / d0') with the rate d0' at which the gap closed.
struct HertzLaw {
    double stiffness, exponent, hysteresis;  ///< K [N/m^n], n, chi
    double least_speed;                      ///< of the rates at which gaps close [m/s]
    CATENARY_RECORD(stiffness, exponent, hysteresis, least_speed)
};
/// The law at n contacts.
struct MarchedHertzLaw {
    HertzLaw law;
    std::span<double> speed;  ///< rates at which gaps closed [m/s], (n,)
    Tangents tangents;        ///< where the law was linearised last
    std::span<double> there;  ///< forces of the law there, not cut at zero [N], (n,)
    CATENARY_RECORD(law, speed, tangents, there)
    CATENARY_SHAPES("*, n, n=n, n")
};
/// Linearise the law at depths [m] and rates [m/s], (n,) each.
void linearise(const MarchedHertzLaw& marched, std::span<const double> depth,
               std::span<const double> rate);
/// Store at the end of a step the rates at which open gaps close.
void remember(const MarchedHertzLaw& marched, std::span<const double> depth,
              std::span<const double> rate);

/// Forces of n contacts as reported at the end of a step.
struct ReportedForces {
    double gamma;                ///< weight of the new force in the reported one; 0 reports itself
    double from_time;            ///< from which on a reported force that pulls ends the run [s]
    std::span<double> latest;    ///< forces of the latest step [N], (n,) if gamma is not 0
    std::span<double> reported;  ///< reported forces (n,) [N]
    CATENARY_RECORD(gamma, from_time, latest, reported)
    CATENARY_SHAPES("*, *, n?, n")
};
/// Whether the contact law holds for forces (n,) at `time` [s]; if so they are remembered. A law
/// with gamma > 0 reports their mean over the step.
bool report(double time, std::span<const double> force, const ReportedForces& law);

}  // namespace catenary
