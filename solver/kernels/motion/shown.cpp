// Outputs of a line.
#include "motion/shown.hpp"

namespace catenary {

void show(const Shown& shown, std::span<double> uplift, std::span<double> dropper_force,
          int64_t begin, int64_t end) {
    for (const int64_t station : {begin, end}) part(shown.columns.starts, station, station + 1);
    const auto first = shown.columns.first[begin], last = shown.columns.last[end];
    for (int64_t i = first[kArms]; i < last[kArms]; ++i)
        uplift[i] = displacement_at(shown.arms[i], shown.motion);
    const auto& motion = shown.motion;
    forces_within(motion, shown.droppers, first[kDroppers], last[kDroppers], dropper_force);
    add_bends(motion, shown.dropper_bends, first[kDroppers], last[kDroppers], dropper_force);
    if (shown.other_force.empty()) return;
    forces_within(motion, shown.others, first[kOthers], last[kOthers], shown.other_force);
    add_bends(motion, shown.other_bends, first[kOthers], last[kOthers], shown.other_force);
}

bool keep(const KeptMotions& kept, int64_t number, const Motion& motion, const Columns& columns) {
    const int64_t begin = columns.starts[kept.moved[0]], end = columns.starts[kept.moved[1]];
    const int64_t n = end - begin, at = part(kept.used, 0, 1)[0];
    if (at + 2 * n > size(kept.numbers)) return false;
    displacements(motion, begin, kept.numbers.subspan(at, n));
    velocities(motion, begin, kept.numbers.subspan(at + n, n));
    const auto stations = kept.stations[number];
    stations[0] = kept.moved[0];
    stations[1] = kept.moved[1];
    stations[2] = at;
    kept.used[0] = at + 2 * n;
    kept.moved[0] = columns.ends[0];
    kept.moved[1] = columns.ends[1];
    copy_all(kept.places, kept.kept_places[number]);
    return true;
}

}  // namespace catenary
