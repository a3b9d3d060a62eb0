// Places of contacts, sums of influence functions in windows, superposition of answers to forces of
// contacts and links, the work of contact forces, and outputs.
#include "contact/contacts.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "base/curves.hpp"
#include "base/targets.hpp"

namespace catenary {

namespace {

/// Columns of a node's two unknowns, or parts of them, with their weights.
struct Pair {
    const double *by_height, *by_slope;
    double height, slope;
    Pair from(int64_t begin) const { return {by_height + begin, by_slope + begin, height, slope}; }
};

Pair columns_of(const Node& node, std::span<const double> data, double height, double slope) {
    const int64_t n = 2 * std::max<int64_t>(0, node.width);
    const double* first = n > 0 ? part(data, node.at, node.at + n).data() : nullptr;
    return {first, first + node.width, height, slope};
}

CATENARY_FOR_TARGETS
void put_both(double* __restrict answer, int64_t n, Pair one, Pair other) {
    for (int64_t j = 0; j < n; ++j) {
        const double of_one = one.height * one.by_height[j] + one.slope * one.by_slope[j];
        answer[j] = of_one + (other.height * other.by_height[j] + other.slope * other.by_slope[j]);
    }
}

CATENARY_FOR_TARGETS
void add_one(double* __restrict answer, int64_t n, Pair one) {
    for (int64_t j = 0; j < n; ++j)
        answer[j] += one.height * one.by_height[j] + one.slope * one.by_slope[j];
}

/// Make the numbers from `low` to `high` zero, if there are any.
void clear(std::span<double> answer, int64_t low, int64_t high) {
    if (low < high) std::ranges::fill(part(answer, low, high), 0.0);
}

/// Put the weighted sum of the columns of two neighbouring nodes, two of each, into `answer`, zero
/// elsewhere. `filled` is the range outside of which it is zero, before and after the call.
void put_columns(const Node* nodes, std::span<const double> data, const double (&weights)[4],
                 std::span<double> answer, int64_t (&filled)[2]) {
    const Node &first = nodes[0], &second = nodes[1];
    const int64_t low = first.begin, high = low + first.width;
    const int64_t last = second.begin, end = last + second.width;
    const Pair one = columns_of(first, data, weights[0], weights[1]);
    const Pair other = columns_of(second, data, weights[2], weights[3]);
    if (!(low <= last && last < high && high <= end)) {
        // One without columns, as beyond a run, or windows that do not overlap.
        clear(answer, filled[0], filled[1]);
        filled[0] = size(answer);
        filled[1] = 0;
        for (int side = 0; side < 2; ++side) {
            const Node& node = nodes[side];
            if (node.width <= 0) continue;
            add_one(part(answer, node.begin, node.begin + node.width).data(), node.width,
                    side ? other : one);
            filled[0] = std::min<int64_t>(filled[0], node.begin);
            filled[1] = std::max<int64_t>(filled[1], node.begin + node.width);
        }
        filled[0] = std::min(filled[0], filled[1]);
        return;
    }
    // Windows of neighbours are nearly the same: their common part is written once.
    clear(answer, std::min(filled[0], low), last);
    clear(answer, high, std::max(filled[1], end));
    double* whole = part(answer, low, end).data();
    add_one(whole, last - low, one);
    put_both(whole + (last - low), high - last, one.from(last - low), other);
    add_one(whole + (high - low), end - high, other.from(high - last));
    filled[0] = low;
    filled[1] = end;
}

/// Add the answer to a force [N] to a motion whose numbers are `spacing` apart.
[[gnu::always_inline]] inline void add_to_motion(double force, const double* __restrict answer,
                                                 int64_t n, int64_t spacing, double* __restrict x,
                                                 double* __restrict y, double* __restrict z,
                                                 const double* gains) {
    const double to_x = gains[0], to_y = gains[1], to_z = gains[2];
    for (int64_t j = 0, at = 0; j < n; ++j, at += spacing) {
        const double change = force * answer[j];
        z[at] += to_z * change;
        x[at] += to_x * change;
        y[at] += to_y * change;
    }
}

/// Add the answer to a force in each of L lanes [N] to motions side by side.
template <int64_t L>
[[gnu::always_inline]] inline void add_to_motions(const double* forces, double sign,
                                                  const double* answer, int64_t n, double* x,
                                                  double* y, double* z, const double* gains) {
    using Lanes = SideBySide<L>;
    const typename Lanes::Numbers force = sign * Lanes::at(forces), to_x = gains[0] * force,
                                  to_y = gains[1] * force, to_z = gains[2] * force;
    for (int64_t j = 0; j < n; ++j) {
        Lanes::at(x + L * j) += to_x * answer[j];
        Lanes::at(y + L * j) += to_y * answer[j];
        Lanes::at(z + L * j) += to_z * answer[j];
    }
}

/// Add the answer to forces [N], of the unknowns from `begin` on, to the motion: to a force in each
/// lane, or to one in the first of them.
CATENARY_FOR_TARGETS
void add_answer(std::span<const double> forces, double sign, std::span<const double> answer,
                int64_t begin, const Motion& motion, std::span<const double> gains) {
    const int64_t n = size(answer), spacing = motion.spacing;
    if (n == 0 || std::ranges::all_of(forces, [](double force) { return force == 0.0; })) return;
    const auto of = [&](std::span<double> all) {
        return part(all, begin * spacing, (begin + n - 1) * spacing + size(forces)).data();
    };
    double *const x = of(motion.x), *const y = of(motion.y), *const z = of(motion.z);
    if (size(forces) > 1)
        with_lanes(spacing, [&](auto lanes) __attribute__((always_inline)) {
            add_to_motions<lanes>(forces.data(), sign, answer.data(), n, x, y, z, gains.data());
        });
    else if (spacing > 1)
        add_to_motion(sign * forces[0], answer.data(), n, spacing, x, y, z, gains.data());
    else
        add_to_motion(sign * forces[0], answer.data(), n, 1, x, y, z, gains.data());
}

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

/// This rank's share of the velocity of a place on a wire [m/s].
double velocity_of(std::span<const int64_t, 4> local, std::span<const double, 4> value,
                   const Motion& motion) {
    double total = 0.0;
    if (motion.x.empty()) return total;
    for (int k = 0; k < 4; ++k) total += value[k] * velocity_at(local[k], motion);
    return total;
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

void superpose(const Contacts& contacts, std::span<const double> force) {
    superpose(contacts, {force.data(), size(force), 1}, contacts.motion);
}

void superpose(const Contacts& contacts, Array2<const double> forces, const Motion& motion) {
    for (int64_t i = 0; i < forces.rows; ++i) {
        const auto& [low, high] = contacts.touches[i].filled;
        const auto answer = part(contacts.answers.by_force[i], low, high);
        add_answer(forces[i], 1.0, answer, low, motion, contacts.motion_gains);
    }
}

void compensate(const Contacts& contacts, std::span<const int64_t> numbers,
                std::span<const double> compensation) {
    compensate(contacts, numbers, {compensation.data(), size(compensation), 1}, contacts.motion);
}

void compensate(const Contacts& contacts, std::span<const int64_t> numbers,
                Array2<const double> compensations, const Motion& motion) {
    const auto& [start, at, width, data] = contacts.link_columns;
    for (int64_t k = 0; k < size(numbers); ++k) {
        const int64_t d = numbers[k];
        const auto answer = part(data, at[d], at[d] + width[d]);
        add_answer(compensations[k], -1.0, answer, start[d], motion, contacts.motion_gains);
    }
}

void begin_work(const Contacts& contacts) {
    for (size_t i = 0; i < contacts.touches.size(); ++i) {
        const Touch& touch = contacts.touches[i];
        contacts.work.ahead[i] = velocity_of(touch.local, touch.value, contacts.motion);
    }
}

void add_work(const Contacts& contacts, std::span<const double> force) {
    const ContactWork& work = contacts.work;
    double added = 0.0;
    for (int64_t i = 0; i < size(force); ++i) {
        const Touch& touch = contacts.touches[i];
        const auto local = work.local[i].first<4>();
        const auto value = work.value[i].first<4>();
        const double behind = velocity_of(local, value, contacts.motion);
        const double now = velocity_of(touch.local, touch.value, contacts.motion);
        added += work.share_before * work.force[i] * (work.before[i] + behind);
        added += work.share_after * force[i] * (work.ahead[i] + now);
        work.force[i] = force[i];
        work.before[i] = now;
        for (int k = 0; k < 4; ++k) {
            local[k] = touch.local[k];
            value[k] = touch.value[k];
        }
    }
    work.total[0] += 0.5 * work.dt * added;
}

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

void move_contacts(const TrainPlaces& places, double way) {
    for (size_t i = 0; i < places.start.size(); ++i) places.now[i] = places.start[i] + way;
    const Leads& leads = places.leads;
    for (int64_t i = 0; i < size(leads.contact); ++i) {
        double& here = places.now[leads.contact[i]];
        const auto of = [&](std::span<const double> all) {
            return part(all, leads.first[i], leads.first[i + 1]);
        };
        here += line_at(of(leads.middle), of(leads.lead), here).first;
    }
}

}  // namespace catenary
