#include "contact/train_places.hpp"

#include <algorithm>

namespace catenary {

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
