// Places of contacts, and forces and heights as outputs.
#include "contact/outputs.hpp"

#include <algorithm>
#include <limits>

namespace catenary {

void write_outputs(const TrainOutputs& outputs, std::span<const double> force,
                   std::span<const double> reported, const Affine& heads,
                   std::span<const double> depth) {
    const auto& [of_strip, of_pantograph] = outputs.ends;
    const auto on_wire = outputs.contact_wire_force;
    std::ranges::fill(on_wire, 0.0);
    for (int64_t p = 0; p + 1 < size(of_pantograph); ++p) {
        double total = 0.0, mean = 0.0, mean_of_wire = 0.0;
        const int64_t first = of_pantograph[p], last = of_pantograph[p + 1];
        const int64_t begin = of_strip[first], end = of_strip[last];
        for (int64_t strip = first; strip < last; ++strip) {
            const int64_t n_wires = of_strip[strip + 1] - of_strip[strip];
            double own = 0.0, height_of_strip = 0.0;
            double lowest = std::numeric_limits<double>::infinity();
            for (int64_t wire = 0; wire < n_wires; ++wire) {
                const int64_t i = of_strip[strip] + wire;
                double height = heads.place[i];
                for (int64_t j = begin; j < end; ++j) height -= heads.by_force(i, j) * force[j];
                own += reported[i];
                if (!on_wire.empty()) on_wire[p * n_wires + wire] += reported[i];
                height_of_strip += height;
                lowest = std::min(lowest, height - depth[i]);
            }
            total += own;
            mean += height_of_strip / static_cast<double>(n_wires);
            mean_of_wire += lowest;
            outputs.strip_force[strip] = own;
        }
        const auto strips = static_cast<double>(last - first);
        outputs.contact_force[p] = total;
        outputs.head_height[p] = mean / strips;
        outputs.wire_height[p] = mean_of_wire / strips;
    }
}

namespace {

/// How far the contact of raked strip i is ahead of its middle [m].
double lead_of(const Leads& leads, int64_t i, double middle) {
    const auto middles = part(leads.middle, leads.first[i], leads.first[i + 1]);
    const auto own = part(leads.lead, leads.first[i], leads.first[i + 1]);
    if (middle >= middles.back()) return own.back();
    const int64_t beyond = std::ranges::upper_bound(middles, middle) - middles.begin();
    if (beyond == 0) return own[0];
    const double before = middles[beyond - 1];
    const double share = (middle - before) / (middles[beyond] - before);
    return own[beyond - 1] + share * (own[beyond] - own[beyond - 1]);
}

}  // namespace

void move_contacts(const TrainPlaces& places, double way) {
    for (size_t i = 0; i < places.start.size(); ++i) places.now[i] = places.start[i] + way;
    const Leads& leads = places.leads;
    for (int64_t i = 0; i < size(leads.contact); ++i) {
        double& here = places.now[leads.contact[i]];
        here += lead_of(leads, i, here);
    }
}

}  // namespace catenary
