// Steps of the scheme `one_solve`.
#include "steps/steps.hpp"

#include <stdexcept>

namespace catenary {

Steps::Steps(StepParts parts, Block block)
    : parts_(std::move(parts)), block_(std::move(block)), course_{parts_.speed} {
    auto refuse_unless = [](bool agrees, const char* why) {
        if (!agrees) throw std::invalid_argument(why);
    };
    const int64_t n = size(parts_.contacts.x), n_heads = static_cast<int64_t>(parts_.heads.size());
    refuse_unless(size(parts_.strips) == 2 * n * (1 + n), "strips are of other contacts");
    refuse_unless(block_.drives.rows == n_heads, "a block drives other heads than its steps have");
    refuse_unless(parts_.problem.room && size(parts_.switched) >= parts_.problem.room->k,
                  "there is no room for links that switch");
    for (const Head* head : parts_.heads) {
        refuse_unless(head && head->first() >= 0 && head->first() + head->n_strips() <= n,
                      "a head has other contacts than the train");
        refuse_unless(block_.drives.columns >= kDrive + 2 * head->n_strips(),
                      "a row that drives a head has too few numbers");
    }
    if (block_.rows.rows == 0) return;
    size_t width = parts_.outputs.size();
    if (parts_.shown) width += parts_.shown->arms.size() + parts_.shown->droppers.law.size();
    for (const auto& channel : parts_.channels) width += channel.size();
    refuse_unless(!parts_.shown || (block_.kept && block_.behind.rows >= n_steps() &&
                                    block_.behind.columns == 2),
                  "a block does not keep what moves on its line");
    refuse_unless(
        block_.rows.rows >= n_steps() && block_.rows.columns == static_cast<int64_t>(width),
        "a block has no room for its outputs");
}

Taken Steps::take(int64_t first, int64_t end) {
    const std::optional<KeptMotions>& kept = block_.kept;
    const bool shows = block_.rows.rows > 0;
    part(block_.times, first, end);
    if (kept) part(kept->moved, 0, 2);
    if (shows) part(kept.value().motion_of, first, end);
    if (!parts_.free || !parts_.shown)
        throw std::invalid_argument("these steps are taken by an ensemble");
    for (int64_t number = first; number < end; ++number) {
        set_off(number);
        parts_.free->step();
        take_in(block_.now, parts_.shown->columns.ends);
        if (kept) take_in(kept->moved, parts_.shown->columns.ends);
        if (!arrive(number)) return {number - first, true, false};
        if (!shows) continue;
        show(number);
        const int64_t motion = kept->motion_of[number];
        if (motion >= 0 && !keep(*kept, motion, parts_.shown->motion, parts_.shown->columns))
            return {number + 1 - first, false, true};
    }
    return {end - first, false, false};
}

bool Steps::arrive(int64_t number) {
    const int64_t n_compensations = predict_heads(number) ? find_forces(number) : kLeft;
    if (n_compensations < 0) return false;
    n_compensations_ = n_compensations;
    finish(n_compensations);
    ++block_.counts[0].steps;
    return true;
}

/// Move the contacts, and evaluate loads.
void Steps::set_off(int64_t number) {
    const double time = block_.times[number];
    move_contacts(parts_.train, way(time));
    place(parts_.contacts);
    begin_work(parts_.contacts);
    for (const Loads& loads : parts_.loads) {
        loads.clock[0] = time;
        evaluate(loads);
    }
}

/// Take the heads' steps without contact; whether all are where their models reach.
bool Steps::predict_heads(int64_t number) {
    const auto drives = block_.drives[number];
    const int64_t n_contacts = size(parts_.problem.found.depth);
    if (!parts_.lateral_place.empty()) {
        find_across(parts_.contacts);
        for (size_t h = 0; h < parts_.heads.size(); ++h)
            parts_.heads[h]->cross(drives[h], parts_.contacts.across, parts_.contacts.touches,
                                   parts_.lateral_place);
    }
    bool within = true;
    for (size_t h = 0; h < parts_.heads.size(); ++h)
        within &= parts_.heads[h]->predict(drives[h], parts_.strips, n_contacts);
    return within;
}

/// Find the contact forces; returns what `catenary::find_forces` does, but never that bounds were
/// too small.
int64_t Steps::find_forces(int64_t number) {
    const SmallProblem& problem = parts_.problem;
    Counts& counts = block_.counts[0];
    while (true) {
        respond(parts_.contacts, problem.share);
        const int64_t n = catenary::find_forces(block_.times[number], problem, parts_.law,
                                                parts_.switched, counts);
        if (n != kTooSmall) return n;
        widen(problem.share.bounds);
        ++counts.repeated;
    }
}

/// Move line and heads by the forces, and fill in the outputs.
void Steps::finish(int64_t n_compensations) {
    const SmallProblem& problem = parts_.problem;
    const int64_t n = size(problem.found.depth);
    const std::span<const double> solution = problem.room->solution, force = solution.first(n);
    superpose(parts_.contacts, force);
    if (n_compensations)
        compensate(parts_.contacts, parts_.switched.first(n_compensations),
                   solution.subspan(n, n_compensations));
    add_work(parts_.contacts, force);
    for (Head* head : parts_.heads) head->move(force);
    write_outputs(parts_.train_outputs, force, parts_.law.reported.reported, problem.heads,
                  problem.found.depth);
    check();
}

/// Check that the results of a step are finite, in builds that search for faults.
void Steps::check() const {
    const auto& [x, y, z, shares, spacing] = parts_.contacts.motion;
    for (auto numbers : {x, y, z}) check_numbers(numbers, "the line's motion");
    for (const Head* head : parts_.heads) check_numbers(head->arrays().state, "a head's motion");
    check_numbers(parts_.train_outputs.contact_force, "contact forces");
    check_numbers(parts_.train_outputs.head_height, "heights of heads");
}

/// Fill the row of a step: outputs of pantographs, of the line, and further channels.
void Steps::show(int64_t number) {
    std::span<double> row = block_.rows[number];
    auto next = [&row](size_t n) {
        const auto first = row.first(n);
        row = row.subspan(n);
        return first;
    };
    std::ranges::copy(parts_.outputs, next(parts_.outputs.size()).begin());
    if (parts_.shown) {
        const Shown& shown = *parts_.shown;
        const auto uplift = next(shown.arms.size()), tension = next(shown.droppers.law.size());
        const auto behind = block_.behind[number];
        catenary::show(shown, uplift, tension, std::min(block_.now[0], behind[0]),
                       std::max(block_.now[1], behind[1]));
    }
    copy_all(parts_.channels, row);
}

}  // namespace catenary
