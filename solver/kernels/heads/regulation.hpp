#pragma once
// A regulated lift: filter, samples, gains, limits, delay. See mbs/control.py.
#include "base/arrays.hpp"

namespace catenary {

struct RegulationSettings {
    double of_height;    ///< 1 if the head's height is measured, 0 for the contact force
    double target;       ///< wanted value [m] or [N]
    double part;         ///< share of the deviation that the filter takes in a step [-]
    double dt;           ///< step [s]
    double sample;       ///< time between samples [s]
    double least, most;  ///< added force [N]
};

/// ControlGains where a value is measured; straight in between, constant beyond the ends.
struct ControlGains {
    double measured;  ///< [m] or [N]
    double of_error, of_integral, of_rate;
};

struct RegulationMemory {
    double time;      ///< [s]
    double next;      ///< when the next sample is [s]
    double filtered;  ///< measured value after the filter [m] or [N]
    double integral;  ///< of the error [.. s]
    double error;     ///< at the latest sample
    double samples;   ///< how many there were, -1 before the first step
    double acting;    ///< added force [N]
};

struct Regulation {
    std::span<const RegulationSettings> settings;  ///< (1,)
    std::span<const ControlGains> gains;           ///< one row at least
    std::span<RegulationMemory> memory;            ///< (1,)
    std::span<double> waiting;                     ///< forces that wait, one a sample of delay [N]
    CATENARY_RECORD(settings, gains, memory, waiting)
    CATENARY_SHAPES("1, g>0, 1")
};

/// Take in the value measured at the end of a step; put the added force of the next one. The
/// integral stands while the force is at a limit and the error would drive it beyond.
void regulate(const Regulation& regulation, double measured);

}  // namespace catenary
