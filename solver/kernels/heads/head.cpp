// Base of all pantographs stepped by Newmark's method.
#include "heads/head.hpp"

#include <algorithm>
#include <limits>
#include <stdexcept>

namespace catenary {

Head::Head(const HeadArrays& arrays)
    : parts_{arrays, 0, {}, {}, {}, {}, {}},
      n_(arrays.touch.columns),
      n_strips_(arrays.touch.rows),
      free_(3 * n_),
      by_force_(3 * n_ * n_strips_) {
    if (size(arrays.out) != 2 * n_strips_ * (1 + n_strips_) || arrays.roll >= n_)
        throw std::invalid_argument("arrays of a head have other shapes than its strips");
}

Head::Head(const HeadParts& parts) : Head(parts.arrays) {
    parts_ = parts;
    if (parts.bending) bend(*parts.bending);
    if (parts.linear.has_value() == parts.sprung.has_value())
        throw std::invalid_argument("a head has one model");
    if (!parts.sprung) return;
    const SprungMasses& sprung = *parts.sprung;
    if (sprung.carrier < 0 || sprung.carrier >= n_)
        throw std::invalid_argument("a head is driven at one of its coordinates");
    if (sprung.mechanism) {
        const int64_t columns = sprung.mechanism->tables.coefficients.rows;
        if (columns < ReducedMechanism::kBlown || columns > ReducedMechanism::kMostColumns)
            throw std::invalid_argument("a mechanism's tables have other columns");
    }
    for (std::vector<double>* room : {&position_, &velocity_, &force_}) room->resize(n_);
    matrix_.resize(n_ * n_);
    if (!sprung.laws.law.empty()) laws_.emplace(sprung.laws, n_);
}

void Head::bend(const Bending& bending) {
    const int64_t m = bending.tables.coefficients.rows;
    if (bending.first < 0 || bending.wires < 1 ||
        bending.first + (n_strips_ / bending.wires) * m > n_)
        throw std::invalid_argument("a head has fewer coordinates than its strips have modes");
    parts_.bending = bending;
    shapes_.resize(m);
    slopes_.resize(m);
}

bool Head::step(std::span<const double> drive) {
    const DriveRow<const double> row{drive, n_strips_};
    if (parts_.lowering && is_held(row.drive())) return true;
    aim(drive);
    return step_free(row.drive());
}

bool Head::is_held(const Drive& drive) {
    LoweringMemory& memory = parts_.lowering->memory.front();
    roof_ = drive.roof;
    if (memory.phase == 0.0 && drive.time > parts_.lowering->time) {
        memory.caught_at = memory.height - parts_.lowering->drop;
        memory.phase = 1.0;
    }
    if (memory.phase < 2.0) return false;
    // Forces do not move a caught head.
    std::ranges::fill(arrays().out, 0.0);
    std::ranges::fill(arrays().out.first(n_strips_), memory.caught_at + drive.roof);
    std::ranges::fill(part(arrays().out, n_strips_, 2 * n_strips_), drive.roof_velocity);
    return true;
}

double Head::height_under(std::span<const double> contact_force) const {
    double total = 0.0;
    for (int64_t i = 0; i < n_strips_; ++i) {
        total += arrays().out[i];
        for (int64_t j = 0; j < n_strips_; ++j)
            total -= arrays().out[2 * n_strips_ + i * n_strips_ + j] * contact_force[j];
    }
    return total / static_cast<double>(n_strips_) - roof_;
}

void Head::aim(std::span<const double> drive) {
    const auto& [touch, state, out, newmark, roll] = arrays();
    const DriveRow<const double> row{drive, n_strips_};
    const auto place = row.place(), rate = row.rate();
    for (int64_t j = 0; roll >= 0 && j < n_strips_; ++j) {
        touch(0, j, roll) = place[j];
        touch(1, j, roll) = rate[j];
    }
    if (!parts_.bending) return;
    const auto& [tables, first, wires] = *parts_.bending;
    const auto m = std::ssize(shapes_);
    for (int64_t j = 0; j < n_strips_; ++j) {
        tables_at(tables, place[j], shapes_, slopes_);
        const int64_t at = first + (j / wires) * m;
        for (int64_t k = 0; k < m; ++k) {
            touch(0, j, at + k) = shapes_[k];
            touch(1, j, at + k) = slopes_[k] * rate[j];
        }
    }
}

void Head::respond(Array2<const double> inverse) {
    const Array2<const double> touch = arrays().touch[0], moving = arrays().touch[1];
    const Array2<double> by = by_force();
    for (int64_t j = 0; j < n_strips_; ++j)
        for (int64_t i = 0; i < n_; ++i) {
            double answer = 0.0;
            for (int64_t k = 0; k < n_; ++k) answer += inverse(i, k) * touch(j, k);
            by(i, j) = newmark().position * answer;
            by(n_ + i, j) = newmark().velocity * answer;
            by(2 * n_ + i, j) = answer;
        }
    for (int64_t i = 0; i < n_strips_; ++i) {
        double height = 0.0, velocity = 0.0;
        for (int64_t k = 0; k < n_; ++k) {
            height += touch(i, k) * free_[k];
            velocity += touch(i, k) * free_[n_ + k] + moving(i, k) * free_[k];
        }
        arrays().out[i] = height;
        arrays().out[n_strips_ + i] = velocity;
        for (int64_t j = 0; j < n_strips_; ++j) {
            height = velocity = 0.0;
            for (int64_t k = 0; k < n_; ++k) {
                height += touch(i, k) * by(k, j);
                velocity += touch(i, k) * by(n_ + k, j) + moving(i, k) * by(k, j);
            }
            const int64_t at = 2 * n_strips_ + i * n_strips_ + j;
            arrays().out[at] = height;
            arrays().out[at + n_strips_ * n_strips_] = velocity;
        }
    }
}

void Head::advance(std::span<const double> contact_force) {
    if (parts_.lowering) {
        LoweringMemory& memory = parts_.lowering->memory.front();
        if (memory.phase == 2.0) return;
        memory.height = height_under(contact_force);
        if (memory.phase == 1.0 && memory.height <= memory.caught_at) memory.phase = 2.0;
    }
    const Array2<double> by = by_force();
    for (int64_t i = 0; i < 3 * n_; ++i) {
        double value = free_[i];
        for (int64_t j = 0; j < n_strips_; ++j) value -= contact_force[j] * by(i, j);
        arrays().state[i] = value;
    }
    remember(contact_force);
    if (parts_.regulation) catenary::regulate(*parts_.regulation, measured(contact_force));
}

/// Measured variable of the lift regulation at the end of a step: mean height of the strips [m], or
/// the sum of their forces [N].
double Head::measured(std::span<const double> contact_force) const {
    const bool of_height = parts_.regulation->settings.front().of_height != 0.0;
    double total = 0.0;
    for (int64_t j = 0; j < n_strips_; ++j) {
        if (!of_height) {
            total += contact_force[j];
            continue;
        }
        for (int64_t k = 0; k < n_; ++k)
            total += arrays().touch(0, j, k) * arrays().state[k] / static_cast<double>(n_strips_);
    }
    return total;
}

void Head::extrapolate(std::span<const double> drive, Array2<double> early) {
    aim(drive);
    const auto q = state(0), v = state(1), a = state(2);
    for (int64_t i = 0; i < n_strips_; ++i) {
        double height = 0.0, speed = 0.0;
        for (int64_t k = 0; k < n_; ++k) {
            const double place = q[k] + newmark().dt * v[k] + newmark().predict_position * a[k];
            const double own = arrays().touch(0, i, k);
            height += own * place;
            speed += own * (v[k] + newmark().predict_velocity * a[k]);
            speed += arrays().touch(1, i, k) * place;
        }
        early(0, i) = height;
        early(1, i) = speed;
    }
}

void Head::cross(std::span<double> drive, const Across& across, std::span<const Touch> touches,
                 std::span<double> place) const {
    const DriveRow<double> row{drive, n_strips_};
    const auto on_strip = row.place(), rate = row.rate();
    for (int64_t j = 0; j < n_strips_; ++j) {
        const int64_t contact = first() + j;
        on_strip[j] += across.place[contact];
        rate[j] += across.rate[contact];
        place[contact] = touches[contact].present != 0.0 ? on_strip[j]
                                                         : std::numeric_limits<double>::quiet_NaN();
    }
}

bool Head::predict(std::span<const double> drive, std::span<double> numbers, int64_t n_contacts) {
    const bool within = step(drive);
    const int64_t s = n_strips_, n = n_contacts;
    const Array2<double> by_height{numbers.data() + 2 * n, n, n};
    const Array2<double> by_velocity{by_height.data + n * n, n, n};
    const auto out = arrays().out;
    for (int64_t i = 0; i < s; ++i) {
        numbers[first() + i] = out[i];
        numbers[n + first() + i] = out[s + i];
        for (int64_t j = 0; j < s; ++j) {
            const int64_t at = 2 * s + i * s + j;
            by_height(first() + i, first() + j) = out[at];
            by_velocity(first() + i, first() + j) = out[at + s * s];
        }
    }
    return within;
}

}  // namespace catenary
