#pragma once
// Where the contacts and pantographs of a train are along the track.
#include "base/arrays.hpp"
#include "base/record.hpp"

namespace catenary {

/// How far contacts of m raked strips are ahead of the strip's middle, straight between points.
struct Leads {
    std::span<const int64_t> contact;  ///< (m,) numbers of the contacts
    std::span<const int64_t> first;    ///< (m + 1,) where the points of each begin
    std::span<const double> middle;    ///< of the strip along the track [m], ascending for each
    std::span<const double> lead;      ///< how far the contact is ahead of it [m]
    CATENARY_RECORD(contact, first, middle, lead)
};

/// Contacts and then pantographs along the track [m]: at the start, now.
struct TrainPlaces {
    std::span<const double> start;
    std::span<double> now;
    Leads leads;
    CATENARY_RECORD(start, now, leads)
};

/// Move all a way [m] ahead of where they started.
void move_contacts(const TrainPlaces& places, double way);

}  // namespace catenary
