// Places of contacts on wires, and answers to forces there.
#include <array>
#include <cmath>

#include "contact/columns.hpp"
#include "contact/contacts.hpp"

namespace catenary {

namespace {

/// Hermite functions N at `xi` in [0, 1] of an element's `length` [m]: w(x) = sum of N times
/// unknowns [m].
std::array<double, 4> shape_values(double xi, double length) {
    const double square = xi * xi, cube = xi * xi * xi;
    return {1 - 3 * square + 2 * cube, length * (xi - 2 * square + cube), 3 * square - 2 * cube,
            length * (cube - square)};
}

/// Derivatives dN/dx: of the functions of deflections [1/m], of rotations [-].
std::array<double, 4> shape_slopes(double xi, double length) {
    const double square = xi * xi;
    return {6 * (square - xi) / length, 1 - 4 * xi + 3 * square, 6 * (xi - square) / length,
            3 * square - 2 * xi};
}

/// Height and slope of the running surface at a place, cubic between samples, zero beyond.
void find_surface(double place, std::span<const Sample> surface, Touch& touch) {
    const int64_t first = touch.samples[0], last = touch.samples[1] - 1;
    touch.surface[0] = touch.surface[1] = 0.0;
    if (!(last > first && surface[first].x <= place && place <= surface[last].x)) return;
    // Mostly the interval of the step before, or one of the next.
    int64_t s = touch.sample;
    while (s < last - 1 && surface[s + 1].x < place) ++s;
    while (s > first && surface[s].x >= place) --s;
    touch.sample = s;
    const Sample &before = surface[s], &after = surface[s + 1];
    const double length = after.x - before.x, xi = (place - before.x) / length;
    auto interpolate = [&](const std::array<double, 4>& by) {
        return by[0] * before.height + by[1] * before.slope + by[2] * after.height +
               by[3] * after.slope;
    };
    touch.surface[0] = interpolate(shape_values(xi, length));
    touch.surface[1] = interpolate(shape_slopes(xi, length));
}

void locate_one(double place, const Wires& wires, Touch& touch) {
    const auto& nodes = wires.nodes;
    const int64_t first = touch.first, last = touch.end - 1;
    part(nodes, first, touch.end);
    // Mostly the element of the step before, or the next one.
    int64_t e = touch.element;
    while (e < last - 1 && nodes[e + 1].x < place) ++e;
    while (e > first && nodes[e].x >= place) --e;
    const Node &before = nodes[e], &after = nodes[e + 1];
    double length = after.x - before.x;
    bool inside = nodes[first].x - kSlip <= place && place <= nodes[last].x + kSlip;
    if (!before.joined) {
        length = 1.0;
        inside = false;
    }
    const double xi = (place - before.x) / length;
    const double lateral = before.y + xi * (after.y - before.y);
    const double present = inside && std::abs(lateral) <= touch.half_length ? 1.0 : 0.0;
    touch.x = place;
    touch.element = e;
    touch.present = present;
    const auto values = shape_values(xi, length), slopes = shape_slopes(xi, length);
    for (int k = 0; k < 4; ++k) {
        const Node& node = k < 2 ? before : after;
        touch.local[k] = node.local[k % 2];
        touch.rest[k] = node.rest[k % 2];
        touch.whole_value[k] = values[k] * present;
        touch.whole_slope[k] = slopes[k] * present;
        touch.value[k] = touch.whole_value[k] * node.owned[k % 2];
        touch.slope[k] = touch.whole_slope[k] * node.owned[k % 2];
    }
    if (!wires.surface.empty()) find_surface(place, wires.surface, touch);
}

}  // namespace

void locate(std::span<const double> x, const Wires& wires, std::span<Touch> touches) {
    for (size_t i = 0; i < x.size(); ++i) locate_one(x[i], wires, touches[i]);
}

void place(const Contacts& contacts) {
    const auto& [by_force, slope] = contacts.answers;
    locate(contacts.x, contacts.wires, contacts.touches);
    for (int64_t i = 0; i < size(contacts.touches); ++i) {
        Touch& touch = contacts.touches[i];
        if (touch.present == 0.0) {
            // A strip without a wire has no answers.
            clear(by_force[i], touch.filled[0], touch.filled[1]);
            if (slope.columns > 0) clear(slope[i], touch.filled[0], touch.filled[1]);
            touch.filled[0] = touch.filled[1] = 0;
            continue;
        }
        const Node* pair = contacts.wires.nodes.subspan(touch.element, 2).data();
        if (slope.columns > 0) {
            int64_t filled[2] = {touch.filled[0], touch.filled[1]};
            put_columns(pair, contacts.columns, touch.whole_slope, slope[i], filled);
        }
        put_columns(pair, contacts.columns, touch.whole_value, by_force[i], touch.filled);
    }
}

void heights(const Contacts& contacts, std::span<double> height, std::span<double> rate) {
    const Motion& motion = contacts.motion;
    const bool moves = !motion.x.empty();
    for (size_t i = 0; i < contacts.touches.size(); ++i) {
        const Touch& touch = contacts.touches[i];
        double w = 0.0, rising = 0.0, steep = 0.0;
        for (int k = 0; touch.present != 0.0 && k < 4; ++k) {
            double total = touch.rest[k];
            if (moves) {
                total += displacement_at(touch.local[k], motion);
                rising += touch.value[k] * velocity_at(touch.local[k], motion);
            }
            w += touch.value[k] * total;
            steep += touch.slope[k] * total;
        }
        // Of the running surface the same share: functions of heights add up to one.
        const double share = touch.value[0] + touch.value[2];
        height[i] = w + share * touch.surface[0];
        rate[i] = rising + contacts.gains.train_speed * (steep + share * touch.surface[1]);
    }
}

void find_across(const Contacts& contacts) {
    const auto& [local, owned, rest] = contacts.sideways;
    for (size_t i = 0; i < contacts.across.place.size(); ++i) {
        const Touch& touch = contacts.touches[i];
        double place = 0.0, rate = 0.0, moved = 0.0;
        for (int k = 0; touch.present != 0.0 && k < 4; ++k) {
            const int64_t node = touch.element + k / 2, unknown = k % 2;
            if (!owned(node, unknown)) continue;
            const int64_t at = local(node, unknown);
            const double value = touch.whole_value[k], slope = touch.whole_slope[k];
            const double own = displacement_at(at, contacts.motion);
            const double total = rest(node, unknown) + own;
            moved += value * own;
            place += value * total;
            rate += value * velocity_at(at, contacts.motion) +
                    contacts.gains.train_speed * slope * total;
        }
        contacts.across.place[i] = place;
        contacts.across.rate[i] = rate;
        contacts.across.moved[i] = moved;
    }
}

}  // namespace catenary
