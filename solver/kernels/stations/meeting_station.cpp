// How the station moves where elimination from both ends meets.
#include "stations/meeting_station.hpp"

#include <algorithm>

namespace catenary {

int64_t middle_of(int64_t low, int64_t high) {
    return (low + high) / 2 / kMiddles * kMiddles;
}

void turn(std::span<int32_t> kinds, const Turning& turning, int64_t before, int64_t middle) {
    part(kinds, std::min(before, middle), std::max(before, middle) + 1);
    part(turning.to_end, 0, size(kinds));
    part(turning.here, middle / kMiddles, middle / kMiddles + 1);
    for (int64_t i = before; i < middle; ++i) kinds[i] = turning.to_end[i];
    for (int64_t i = middle + 1; i <= before; ++i) kinds[i] = turning.to_start[i];
    kinds[middle] = turning.here[middle / kMiddles];
}

}  // namespace catenary
