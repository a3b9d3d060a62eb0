// Superposition of the answers to forces of contacts and links, and the work of contact forces.
#include "contact/columns.hpp"
#include "contact/contacts.hpp"

namespace catenary {

namespace {

/// This rank's share of the velocity of a place on a wire [m/s].
double velocity_of(std::span<const int64_t, 4> local, std::span<const double, 4> value,
                   const Motion& motion) {
    double total = 0.0;
    if (motion.x.empty()) return total;
    for (int k = 0; k < 4; ++k) total += value[k] * velocity_at(local[k], motion);
    return total;
}

}  // namespace

void superpose(const Contacts& contacts, std::span<const double> force) {
    for (int64_t i = 0; i < size(force); ++i) {
        if (force[i] == 0.0) continue;
        const auto& [low, high] = contacts.touches[i].filled;
        const auto answer = part(contacts.answers.by_force[i], low, high);
        add_answer(force[i], answer, low, contacts.motion, contacts.motion_gains);
    }
}

void compensate(const Contacts& contacts, std::span<const int64_t> numbers,
                std::span<const double> compensation) {
    const auto& [start, at, width, data] = contacts.link_columns;
    for (size_t k = 0; k < numbers.size(); ++k) {
        if (compensation[k] == 0.0) continue;
        const int64_t d = numbers[k];
        const auto answer = part(data, at[d], at[d] + width[d]);
        add_answer(-compensation[k], answer, start[d], contacts.motion, contacts.motion_gains);
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

}  // namespace catenary
