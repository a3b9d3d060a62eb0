// Influence coefficients of contacts on each other.
#include "contact/response.hpp"

#include <algorithm>
#include <cmath>

namespace catenary {

namespace {

/// Interpolation of an answer (n_local,), which may have no numbers.
double answer_at(const int64_t (&local)[4], const double (&weights)[4],
                 std::span<const double> answer) {
    double total = 0.0;
    if (answer.empty()) return total;
    for (int k = 0; k < 4; ++k) total += weights[k] * answer[local[k]];
    return total;
}

/// Fill in heights, rates and the increase of both by forces; whether heights and rates are finite.
bool meet(const Contacts& contacts, const Affine& line) {
    const auto& [by_force, by_slope] = contacts.answers;
    const auto& touches = contacts.touches;
    const Gains& gains = contacts.gains;
    heights(contacts, line.place, line.rate);
    double total = 0.0;
    for (int64_t i = 0; i < size(touches); ++i) {
        const Touch& touch = touches[i];
        total += line.place[i] + line.rate[i];
        for (int64_t j = 0; j < size(touches); ++j) {
            if (touch.present == 0.0 || touches[j].present == 0.0) {
                line.by_force(i, j) = line.rate_by_force(i, j) = 0.0;
                continue;
            }
            const double by_value = answer_at(touch.local, touch.value, by_force[j]);
            line.by_force(i, j) = gains.position * by_value;
            if (by_slope.columns == 0) continue;
            const double along = answer_at(touch.local, touch.slope, by_force[j]);
            line.rate_by_force(i, j) =
                gains.train_speed * gains.position * along + gains.velocity * by_value;
        }
    }
    return std::isfinite(total);
}

}  // namespace

void respond(const Contacts& contacts, const Share& share) {
    for (size_t i = 0; i < contacts.touches.size(); ++i)
        share.present[i] = contacts.touches[i].present;
    // A NaN elsewhere reaches the reserve of a link one step later and is caught there.
    const int64_t count = meet(contacts, share.line) ? watch(contacts, share) : -1;
    const int64_t room = share.rows.capacity();
    Flags& flags = share.flags[0];
    flags.rows = static_cast<double>(std::clamp<int64_t>(count, 0, room));
    flags.broken = count < 0;
    flags.missing = count > room ? static_cast<double>(count) : 0.0;
}

}  // namespace catenary
