// Influence coefficients of contacts on each other, and which links near the train, or near their
// margin, may switch within a step.
#include "contact/response.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/targets.hpp"

namespace catenary {

namespace {

/// Whether a reserve is below a margin, or not finite.
bool is_beyond(double reserve, double margin) {
    return !(margin <= reserve && reserve < std::numeric_limits<double>::infinity());
}

CATENARY_FOR_TARGETS
bool any_beyond(std::span<const double> reserve, double margin) {
    int64_t count = 0;
    for (const double one : reserve) count += is_beyond(one, margin);
    return count > 0;
}

/// Increase of a link's reserve by a unit of acceleration of its stretch [N s2/m].
double per_acceleration(const Reserve& law, const Gains& gains) {
    return law.stiffness * gains.position + law.damping * gains.velocity;
}

/// Fill in the couplings of contacts with one of `links`.
void put_couplings(const LinkRows& rows, int64_t at, const Links& links, int64_t link,
                   const Contacts& contacts) {
    const auto& [by_force, by_slope] = contacts.answers;
    const Gains& gains = contacts.gains;
    const double worth = per_acceleration(links.law[link], gains);
    for (int64_t i = 0; i < by_force.rows; ++i) {
        const double apart = stretch_of(link, links, by_force[i]);
        rows.reaction(at, i) = worth * apart;
        rows.lift(at, i) = gains.position * apart;
        rows.rise(at, i) = 0.0;
        if (by_slope.columns == 0) continue;
        const double along = stretch_of(link, links, by_slope[i]);
        rows.rise(at, i) = gains.velocity * apart + gains.train_speed * gains.position * along;
    }
}

/// Least reserve of a link under contact forces within the bounds [N].
double least_reserve(int64_t link, const Contacts& contacts, const Bounds& bounds) {
    const Followed& followed = contacts.followed;
    const Gains& gains = contacts.gains;
    const Reserve& law = followed.links.law[link];
    const double worth = per_acceleration(law, gains);
    double left = followed.reserve[link];
    for (int64_t i = 0; i < size(contacts.touches); ++i) {
        const Touch& touch = contacts.touches[i];
        if (touch.present == 0.0 || !(std::abs(law.place - touch.x) <= gains.reach)) continue;
        const double change =
            worth * stretch_of(link, followed.links, contacts.answers.by_force[i]);
        left += std::min(change * bounds.push[i], -change * bounds.pull[i]);
    }
    return left;
}

/// Fill in a row for each link that may switch within the bounds of a share, as far as rows fit;
/// rows of dependents follow their leaders'. Contacts act on links within reach only. Returns the
/// number of these links, dependents included; -1 if a reserve is not finite.
int64_t watch(const Contacts& contacts, const Share& share) {
    const auto& [numbers, links, reserve, moving, dependents, dependent_numbers] =
        contacts.followed;
    const auto laws = links.law;
    const double margin = share.bounds.loss[0], reach = contacts.gains.reach;
    const auto [lowest, highest] = std::ranges::minmax_element(contacts.touches, {}, &Touch::x);
    const auto near = std::ranges::lower_bound(laws, lowest->x - reach, {}, &Reserve::place);
    const auto far = std::ranges::upper_bound(laws, highest->x + reach, {}, &Reserve::place);
    const int64_t first = std::max<int64_t>(near - laws.begin(), moving[0]);
    const int64_t last = std::min<int64_t>(far - laws.begin(), moving[1]);
    // Mostly none is near its margin by itself: then links beyond reach are not tested.
    int64_t begin = first, end = last;
    if (any_beyond(part(reserve, moving[0], moving[1]), margin)) {
        begin = moving[0];
        end = moving[1];
    }
    int64_t count = 0;
    auto put = [&](int64_t number, double left, const Links& own, int64_t link) {
        if (count < share.rows.capacity()) {
            share.rows.put_number(count, number);
            share.rows.reserve(count) = left;
            put_couplings(share.rows, count, own, link, contacts);
        }
        ++count;
    };
    for (int64_t d = begin; d < end; ++d) {
        bool candidate = is_beyond(reserve[d], margin);
        if (!candidate && !(first <= d && d < last)) continue;
        if (!std::isfinite(reserve[d])) return -1;
        if (laws[d].released == 0.0) continue;
        candidate = candidate || least_reserve(d, contacts, share.bounds) < margin;
        if (!candidate) continue;
        put(numbers[d], reserve[d], links, d);
        for (int64_t r = dependents.begin[d]; r < dependents.begin[d + 1]; ++r)
            put(dependent_numbers[r], reserve_of(r, dependents.links, contacts.motion),
                dependents.links, r);
    }
    return count;
}

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
