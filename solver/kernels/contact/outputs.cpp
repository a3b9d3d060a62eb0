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

}  // namespace catenary
