// Derivatives of a march by its parameters.
#include "tangents/tangents.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace catenary {

namespace {

/// Second derivatives of the Hermite functions along the track: of deflections [1/m2], of rotations
/// [1/m].
std::array<double, 4> shape_curvatures(double xi, double length) {
    const double square = length * length;
    return {(12 * xi - 6) / square, (6 * xi - 4) / length, (6 - 12 * xi) / square,
            (6 * xi - 2) / length};
}

/// Displacement and velocity of an unknown as they are.
struct Moved {
    double displacement, velocity;
};
Moved moved_at(int64_t unknown, const Motion& motion) {
    return {displacement_at(unknown, motion), velocity_at(unknown, motion)};
}

double at(std::span<const double> numbers, int64_t i) {
    return numbers.empty() ? 0.0 : numbers[i];
}

}  // namespace

TangentSteps::TangentSteps(StepParts parts, Block block, MarchTangents tangents)
    : Steps(std::move(parts), std::move(block)),
      tangents_(std::move(tangents)),
      heads_(this->parts().heads, tangents_.pairs, force()) {
    const StepParts& own = this->parts();
    for (const TangentGroup& group : tangents_.groups) {
        if (static_cast<int64_t>(group.tangents.size()) > group.lanes.n())
            throw std::invalid_argument("a group of tangents has more than lanes");
        for (const Tangent& tangent : group.tangents)
            if (tangent.heads.size() != heads_.n())
                throw std::invalid_argument("a tangent has other heads than the steps");
    }
    const int64_t n = n_contacts(), most = own.problem.room->k;
    for (auto* numbers : {&place_, &rate_}) numbers->resize(n);
    for (auto* numbers : {&right_, &solution_}) numbers->resize(most);
    side_by_side_.resize(most * kMostScenes);
}

Taken TangentSteps::take(int64_t first, int64_t end) {
    for (const TangentGroup& group : tangents_.groups)
        for (const Tangent& tangent : group.tangents)
            if (tangent.results.rows < in_march(end))
                throw std::invalid_argument("a tangent has results of fewer steps");
    for (int64_t number = first; number < end; ++number) {
        heads_.keep();
        const Taken taken = Steps::take(number, number + 1);
        if (taken.begun) return {number - first, true, false};
        find_acting();
        count();
        fill_matrix();
        for (const TangentGroup& group : tangents_.groups) follow(group, number);
        if (taken.is_full) return {number + 1 - first, false, true};
    }
    return {end - first, false, false};
}

/// Find the contacts and links that act in the step that was taken.
void TangentSteps::find_acting() {
    const SmallProblem& problem = parts().problem;
    std::swap(acting_, was_);
    acting_.contacts.clear();
    acting_.rows.clear();
    acting_.numbers.clear();
    const auto acts = problem.room->acts;
    for (int64_t i = 0; i < n_contacts(); ++i) {
        acts[i] = force()[i] != 0.0 || (problem.pulls && problem.share.present[i] != 0.0);
        if (acts[i]) acting_.contacts.push_back(i);
    }
    for (int64_t k = 0; k < n_compensations(); ++k) {
        acts[n_contacts() + k] = force()[n_contacts() + k] != 0.0;
        if (!acts[n_contacts() + k]) continue;
        acting_.rows.push_back(k);
        acting_.numbers.push_back(problem.share.rows.number(k));
    }
}

void TangentSteps::count() {
    const auto switches = tangents_.switches;
    switches[0] += static_cast<int64_t>(acting_.contacts.size()) < n_contacts();
    if (!has_begun_) was_ = acting_;
    has_begun_ = true;
    switches[1] += acting_.contacts != was_.contacts;
    switches[2] += acting_.numbers != was_.numbers;
}

/// Put the matrix of the small problem with the tangents of the law under the forces found.
void TangentSteps::fill_matrix() const {
    const SmallProblem& problem = parts().problem;
    const Tangents& tangents = problem.tangents;
    press(problem.gap, tangents, *problem.room);
    if (n_compensations() > 0)
        couple(problem.share.rows, n_compensations(), problem.coupled, tangents.by_depth,
               tangents.by_rate, *problem.room);
}

/// Take a group of tangents through the step that was taken.
void TangentSteps::follow(const TangentGroup& group, int64_t number) {
    const TangentLanes& lanes = group.lanes;
    const int64_t n_lanes = lanes.n(), n = n_contacts(), n_links = size(acting_.rows);
    const double time = block().times[number] - course().since;
    const int64_t n_tangents = size(group.tangents);
    const Motion& march = parts().contacts.motion;
    const bool is_loaded = !lanes.loads.empty();
    wake(*lanes.passes);
    lanes.passes->follow(is_loaded ? &march : nullptr);
    if (is_loaded) {
        catenary::load(lanes, march);
        for (int64_t s = 0; s < n_tangents; ++s)
            load(group.tangents[s], lanes, s, group.tangents[s].speed * time);
    }
    lanes.passes->step();
    // Of all contacts, and of acting links.
    const Array2<double> forces{side_by_side_.data(), n, n_lanes},
        of_links{side_by_side_.data() + n * n_lanes, n_links, n_lanes};
    std::ranges::fill(side_by_side_, 0.0);
    const Array2<double> drives = block().drives[number];
    for (int64_t s = 0; s < n_tangents; ++s) {
        const Tangent& tangent = group.tangents[s];
        const Motion own = lanes.at(s);
        for (auto* numbers : {&place_, &rate_}) std::ranges::fill(*numbers, 0.0);
        heads_.predict(tangent.heads, drives, changed_drives(tangent, number), {place_, rate_});
        find_places(tangent, own, tangent.speed * time);
        solve(tangent, own);
        for (int64_t i : acting_.contacts) forces(i, s) = solution_[i];
        for (int64_t k = 0; k < n_links; ++k) of_links(k, s) = solution_[n + acting_.rows[k]];
        heads_.move(tangent.heads, solution_);
        remember(tangent);
        show(tangent, number);
    }
    superpose(parts().contacts, forces, lanes.motion);
    compensate(parts().contacts, acting_.numbers, of_links, lanes.motion);
    show_arms(group, number);
}

/// Let the stations move that forces move.
void TangentSteps::wake(LanePasses& passes) const {
    const Contacts& contacts = parts().contacts;
    for (int64_t i : acting_.contacts) {
        const auto& [low, high] = contacts.touches[i].filled;
        passes.wake(low, high);
    }
    const auto& [start, at, width, data] = contacts.link_columns;
    for (int64_t d : acting_.numbers) passes.wake(start[d], start[d] + width[d]);
}

/// Derivatives of the rows that drive the heads in a step; no rows if they do not change.
Array2<const double> TangentSteps::changed_drives(const Tangent& tangent, int64_t number) const {
    if (tangent.drives.n == 0) return {};
    return tangent.drives[std::min(in_march(number), tangent.drives.n - 1)];
}

/// Solve the small problem of a tangent.
void TangentSteps::solve(const Tangent& tangent, const Motion& own) {
    const Room& room = *parts().problem.room;
    const auto& released = parts().problem.coupled.released;
    for (int64_t i : acting_.contacts) right_[i] = of_law(tangent, i);
    for (size_t k = 0; k < acting_.rows.size(); ++k)
        right_[n_contacts() + acting_.rows[k]] =
            -released[acting_.numbers[k]] * of_reserve(tangent, own, acting_.numbers[k]);
    const int64_t n = n_contacts() + n_compensations();
    solve_on({room.matrix, right_, solution_}, room.acts.first(n), room);
}

/// Add the loads of a tangent by the march's forces, whose links or places change.
void TangentSteps::load(const Tangent& tangent, const TangentLanes& lanes, int64_t lane,
                        double way) const {
    auto add = [&](int64_t unknown, double force) {
        lanes.loads[unknown * lanes.n() + lane] += force;
    };
    for (size_t k = 0; tangent.links.weights.rows > 0 && k < acting_.rows.size(); ++k) {
        const int64_t link = acting_.numbers[k];
        const double compensation = force()[n_contacts() + acting_.rows[k]];
        const auto unknowns = tangents_.links.unknowns[link];
        for (size_t j = 0; j < unknowns.size(); ++j)
            add(unknowns[j], -tangent.links.weights(link, j) * compensation);
    }
    for (int64_t i : acting_.contacts) {
        const Touch& touch = parts().contacts.touches[i];
        const double moved = at(tangent.start, i) + way;
        if (moved == 0.0) continue;
        for (int j = 0; j < 4; ++j) add(touch.local[j], force()[i] * touch.slope[j] * moved);
    }
}

/// Subtract the changes of the wires' heights from gaps.
void TangentSteps::find_places(const Tangent& tangent, const Motion& own, double way) {
    const Contacts& contacts = parts().contacts;
    const double speed = contacts.gains.train_speed;
    for (int64_t i = 0; i < n_contacts(); ++i) {
        const Touch& touch = contacts.touches[i];
        if (touch.present == 0.0) continue;
        const double moved = at(tangent.start, i) + way;
        const Node& before = contacts.wires.nodes[touch.element];
        const double length = contacts.wires.nodes[touch.element + 1].x - before.x;
        const auto curvature = shape_curvatures((touch.x - before.x) / length, length);
        for (int j = 0; j < 4; ++j) {
            const auto [dd, dv] = moved_at(touch.local[j], own);
            const auto [d, v] = moved_at(touch.local[j], contacts.motion);
            double shifted = dd;
            if (tangent.rest.rows > 0) shifted += tangent.rest(touch.element + j / 2, j % 2);
            const double total = touch.rest[j] + d;
            place_[i] -= touch.value[j] * shifted + touch.slope[j] * total * moved;
            rate_[i] -= touch.value[j] * dv + speed * touch.slope[j] * shifted +
                        (touch.slope[j] * v + speed * curvature[j] * total) * moved +
                        tangent.speed * touch.slope[j] * total;
        }
        const double share = touch.value[0] + touch.value[2];
        place_[i] -= share * touch.surface[1] * moved;
        rate_[i] -= share * tangent.speed * touch.surface[1];
    }
}

/// Derivative of a contact's law without changes of forces.
double TangentSteps::of_law(const Tangent& tangent, int64_t i) const {
    const SmallProblem& problem = parts().problem;
    const double depth = problem.found.depth[i], rate = problem.found.rate[i];
    double value =
        problem.tangents.by_depth[i] * place_[i] + problem.tangents.by_rate[i] * rate_[i];
    const auto& changes = tangent.law.tangents;
    if (changes.rows > 0)
        value += changes(1, i) + changes(2, i) * depth + changes(3, i) * rate -
                 changes(0, i) * force()[i];
    if (!parts().law.marched) return value;
    const auto& [law, speed, tangents, there] = *parts().law.marched;
    const double spring = law.stiffness * std::pow(depth, law.exponent);
    const double by_speed = -spring * law.hysteresis * rate / (speed[i] * speed[i]);
    value += by_speed * tangent.law.speed[i];
    if (tangent.law.hertz.empty()) return value;
    const double loss = 1.0 + law.hysteresis * rate / speed[i];
    const auto change = tangent.law.hertz;
    return value + spring * loss * (change[0] / law.stiffness + change[1] * std::log(depth)) +
           spring * rate / speed[i] * change[2];
}

/// Derivative of a link's reserve without changes of forces.
double TangentSteps::of_reserve(const Tangent& tangent, const Motion& own, int64_t link) const {
    const Motion& motion = parts().contacts.motion;
    const Links& links = tangents_.links;
    const auto& [law, weights] = tangent.links;
    double value = reserve_of(link, links, own) - links.law[link].rest;
    if (law.rows == 0 && weights.rows == 0) return value;
    const Reserve& rule = links.law[link];
    if (law.rows > 0) value += law(link, 0);
    for (int64_t k = 0; k < links.unknowns.columns; ++k) {
        const auto [d, v] = moved_at(links.unknowns(link, k), motion);
        if (law.rows > 0) value += links.weights(link, k) * (law(link, 1) * d + law(link, 2) * v);
        if (weights.rows > 0) value += weights(link, k) * (rule.stiffness * d + rule.damping * v);
    }
    return value;
}

/// Keep the derivatives of a Hertzian law's memory, see `remember` of the law.
void TangentSteps::remember(const Tangent& tangent) const {
    if (!parts().law.marched) return;
    const SmallProblem& problem = parts().problem;
    const double least = parts().law.marched->law.least_speed;
    for (int64_t i = 0; i < n_contacts(); ++i) {
        if (problem.found.depth[i] > 0.0) continue;
        double& speed = tangent.law.speed[i];
        if (problem.found.rate[i] <= least) {
            speed = at(tangent.law.hertz, 3);
            continue;
        }
        speed = rate_[i];
        for (int64_t j = 0; j < n_contacts(); ++j)
            speed -= problem.gap.rate_by_force(i, j) * solution_[j];
        for (int64_t k : acting_.rows)
            speed += problem.share.rows.rise(k, i) * solution_[n_contacts() + k];
    }
}

/// Fill in a tangent's row but for the displacements at arms.
void TangentSteps::show(const Tangent& tangent, int64_t number) const {
    const auto& [of_strip, of_pantograph] = parts().train_outputs.ends;
    const double gamma = parts().law.reported.gamma;
    const auto row = tangent.results[in_march(number)];
    const int64_t n_pantographs = size(of_pantograph) - 1;
    for (int64_t p = 0; p < n_pantographs; ++p) {
        row[p] = 0.0;
        for (int64_t i = of_strip[of_pantograph[p]]; i < of_strip[of_pantograph[p + 1]]; ++i) {
            row[p] += gamma == 0.0 ? solution_[i]
                                   : gamma * solution_[i] + (1.0 - gamma) * tangent.law.latest[i];
            tangent.law.latest[i] = solution_[i];
        }
    }
    const auto heights = row.subspan(n_pantographs + size(tangents_.arms));
    for (int64_t p = 0; p < n_pantographs; ++p) heights[p] = heads_.height(p, tangent.heads[p]);
}

/// Fill in the displacements at arms in the rows of a group.
void TangentSteps::show_arms(const TangentGroup& group, int64_t number) const {
    const auto arms = tangents_.arms;
    const int64_t first = size(parts().train_outputs.ends.of_pantograph) - 1;
    for (int64_t i = 0; i < size(arms); ++i)
        for (size_t s = 0; s < group.tangents.size(); ++s)
            group.tangents[s].results(in_march(number), first + i) =
                displacement_at(arms[i], group.lanes.at(s));
}

}  // namespace catenary
