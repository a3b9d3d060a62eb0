// Pantographs stepped by Newmark's method: a regulated lift, laws that are not linear, the base of
// all, and steps without contact, of linear chains and of masses whose matrix is made anew.
#include "heads/head.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <stdexcept>

namespace catenary {

namespace {

/// Part of a step by which a sample may come early: times are sums.
constexpr double kEarly = 1e-6;

ControlGains gains_at(std::span<const ControlGains> gains, double measured) {
    const int64_t n = size(gains);
    int64_t i = 0;
    while (i < n - 2 && gains[i + 1].measured <= measured) ++i;
    const ControlGains &low = gains[i], &high = gains[std::min(i + 1, n - 1)];
    double part = 0.0;
    if (&high != &low)
        part = std::clamp((measured - low.measured) / (high.measured - low.measured), 0.0, 1.0);
    return {measured, low.of_error + part * (high.of_error - low.of_error),
            low.of_integral + part * (high.of_integral - low.of_integral),
            low.of_rate + part * (high.of_rate - low.of_rate)};
}

/// Take in the value measured at the end of a step; put the added force of the next one. The
/// integral stands while the force is at a limit and the error would drive it beyond.
void regulate(const Regulation& regulation, double measured) {
    const RegulationSettings& settings = regulation.settings.front();
    RegulationMemory& memory = regulation.memory.front();
    memory.time += settings.dt;
    if (memory.samples < 0.0) {
        // The first step begins where it is: a filter has no start of its own.
        memory.filtered = measured;
        memory.samples = 0.0;
    }
    memory.filtered += settings.part * (measured - memory.filtered);
    if (memory.time < memory.next - kEarly * settings.dt) return;
    memory.next += settings.sample;
    const double error = settings.target - memory.filtered;
    const ControlGains gains = gains_at(regulation.gains, memory.filtered);
    const double rate = memory.samples == 0.0 ? 0.0 : (error - memory.error) / settings.sample;
    const double integral = memory.integral + settings.sample * error;
    const double wanted =
        gains.of_error * error + gains.of_integral * integral + gains.of_rate * rate;
    const double allowed = std::min(std::max(wanted, settings.least), settings.most);
    if ((settings.least <= wanted && wanted <= settings.most) ||
        (wanted - allowed) * gains.of_integral * error <= 0.0)
        memory.integral = integral;
    memory.error = error;
    if (regulation.waiting.empty()) {
        memory.acting = allowed;
    } else {
        double& waiting =
            regulation.waiting[static_cast<int64_t>(memory.samples) % size(regulation.waiting)];
        memory.acting = waiting;
        waiting = allowed;
    }
    memory.samples += 1.0;
}

/// Segments of tables mostly settle in two rounds; a cycle of segments is left after so many.
constexpr int kMostRounds = 20;

/// The part of a law's variable that is not the head's: of base, roof and where it counts from.
double outside(const HeadLaw& law, const StepStart& start) {
    return law.of_rate ? law.by_base * start.base_velocity + law.by_roof * start.roof_velocity
                       : law.by_base * start.base + law.by_roof * start.roof - law.zero;
}

}  // namespace

SettlingLaws::SettlingLaws(const HeadLaws& laws, int64_t n)
    : laws_(laws),
      plain_force_(n),
      plain_matrix_(n * n),
      acceleration_(n),
      segment_(laws.law.size()) {
    for (const HeadLaw& law : laws.law)
        if (law.begin < 0 || law.end < law.begin + 2 || law.end > size(laws.points))
            throw std::invalid_argument("a law has two points at least");
}

/// Find the segments in which laws are with the accelerations at hand; whether one has changed.
bool SettlingLaws::find_segments(const StepStart& start, const NewmarkFactors& newmark) {
    bool changed = false;
    for (int64_t j = 0; j < size(laws_.law); ++j) {
        const HeadLaw& law = laws_.law[j];
        const auto way = laws_.ways[j];
        double at = outside(law, start);
        for (int64_t i = 0; i < size(way); ++i)
            at += way[i] * (law.of_rate ? start.velocity[i] + newmark.velocity * acceleration_[i]
                                        : start.position[i] + newmark.position * acceleration_[i]);
        int64_t k = law.begin;
        while (k < law.end - 2 && laws_.points[k + 1].at <= at) ++k;
        changed = changed || k != segment_[j];
        segment_[j] = k;
    }
    return changed;
}

/// Add a law along its segment.
void SettlingLaws::add(int64_t number, const StepStart& start, const NewmarkFactors& newmark,
                       std::span<double> force, Array2<double> matrix) const {
    const HeadLaw& law = laws_.law[number];
    const auto way = laws_.ways[number];
    const int64_t n = size(way);
    const HeadLawPoint &low = laws_.points[segment_[number]],
                       &high = laws_.points[segment_[number] + 1];
    const double slope = (high.force - low.force) / (high.at - low.at);
    const double factor = law.of_rate ? newmark.velocity : newmark.position;
    const auto predicted = law.of_rate ? start.velocity : start.position;
    double at = outside(law, start);
    for (int64_t i = 0; i < n; ++i) at += way[i] * predicted[i];
    const double pull = low.force + slope * (at - low.at);
    for (int64_t i = 0; i < n; ++i) {
        if (way[i] == 0.0) continue;
        force[i] -= way[i] * pull;
        for (int64_t k = 0; k < n; ++k) matrix(i, k) += factor * slope * way[i] * way[k];
    }
}

void SettlingLaws::settle(const StepStart& start, const NewmarkFactors& newmark,
                          std::span<double> force, Array2<double> matrix) {
    const int64_t n = size(force);
    std::ranges::copy(force, plain_force_.begin());
    std::ranges::copy(matrix.all(), plain_matrix_.begin());
    std::ranges::copy(start.acceleration, acceleration_.begin());
    std::ranges::fill(segment_, -1);
    for (int round = 0; round < kMostRounds; ++round) {
        if (!find_segments(start, newmark)) return;
        std::ranges::copy(plain_force_, force.begin());
        std::ranges::copy(plain_matrix_, matrix.all().begin());
        for (int64_t j = 0; j < size(laws_.law); ++j) add(j, start, newmark, force, matrix);
        invert(matrix);
        for (int64_t i = 0; i < n; ++i) {
            double value = 0.0;
            for (int64_t k = 0; k < n; ++k) {
                double push = force[k];
                for (int64_t j = 0; j < size(laws_.pressed); ++j)
                    push -= start.touch(j, k) * laws_.pressed[j];
                value += matrix(i, k) * push;
            }
            acceleration_[i] = value;
        }
    }
}

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
    time_ = row.drive().time;
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
    if (laws_) std::ranges::copy(contact_force, parts_.sprung->laws.pressed.begin());
    if (parts_.regulation) catenary::regulate(*parts_.regulation, measured(contact_force));
    if (after_) after_(time_, contact_force);
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

bool Head::step_free(const Drive& drive) {
    if (!parts_.linear) return step_sprung(drive);
    step_linear(drive);
    return true;
}

void Head::step_linear(const Drive& drive) {
    const auto& [matrix, by_drive, by_head, inverse] = *parts_.linear;
    const std::span<const double> now = arrays().state;
    const double lift = drive.force + added(drive);
    for (int64_t i = 0; i < size(now); ++i) {
        double value = lift * by_drive[i] + drive.head_air * by_head[i];
        const auto row = matrix[i];
        for (int64_t k = 0; k < size(now); ++k) value += row[k] * now[k];
        free_[i] = value;
    }
    respond(inverse);
}

bool Head::step_sprung(const Drive& drive) {
    const SprungMasses& sprung = *parts_.sprung;
    const auto &stiffness = sprung.stiffness, &damping = sprung.damping;
    const NewmarkFactors& s = newmark();
    const auto q = state(0), v = state(1), a = state(2);
    const Array2<double> matrix{matrix_.data(), n_, n_};
    for (int64_t i = 0; i < n_; ++i) {
        position_[i] = q[i] + s.dt * v[i] + s.predict_position * a[i];
        velocity_[i] = v[i] + s.predict_velocity * a[i];
    }
    for (int64_t i = 0; i < n_; ++i) {
        double value = 0.0;
        for (int64_t k = 0; k < n_; ++k) {
            value -= stiffness(i, k) * position_[k] + damping(i, k) * velocity_[k];
            matrix(i, k) = s.velocity * damping(i, k) + s.position * stiffness(i, k);
        }
        force_[i] = value + drive.head_air * sprung.push[i];
        matrix(i, i) += sprung.masses[i];
    }
    bool within = true;
    if (sprung.mechanism)
        within = raise(drive, *sprung.mechanism);
    else
        force_[sprung.carrier] += drive.force + added(drive);
    if (laws_)
        laws_->settle({position_, velocity_, a, arrays().touch[0], drive.base, drive.base_velocity,
                       drive.roof, drive.roof_velocity},
                      s, force_, matrix);
    else
        invert(matrix);
    for (int64_t i = 0; i < n_; ++i) {
        double acceleration = 0.0;
        for (int64_t k = 0; k < n_; ++k) acceleration += matrix(i, k) * force_[k];
        free_[i] = position_[i] + s.position * acceleration;
        free_[n_ + i] = velocity_[i] + s.velocity * acceleration;
        free_[2 * n_ + i] = acceleration;
    }
    respond(matrix);
    return within;
}

bool Head::raise(const Drive& drive, const ReducedMechanism& mechanism) {
    using enum ReducedMechanism::Column;
    const SplineTables& tables = mechanism.tables;
    const int64_t at = parts_.sprung->carrier, m = tables.coefficients.rows;
    const NewmarkFactors& s = newmark();
    height_ = position_[at] - mechanism.zero - drive.base;
    const double speed = velocity_[at] - drive.base_velocity;
    std::array<double, kMostColumns> value{}, slope{};
    tables_at(tables, height_, std::span(value).first(m), std::span(slope).first(m));
    force_[at] += drive.part * (value[kLift] - mechanism.weight) + added(drive) -
                  value[kSlowing] * speed - 0.5 * slope[kMass] * speed * speed;
    // The base carries the mechanism along, but less mass than the raised one if parts stay low.
    force_[at] += (value[kMass] - value[kCarried]) * drive.base_acceleration;
    force_[at] += drive.arm_air + drive.bodies_air * value[kBlown];
    matrix_[at * (n_ + 1)] +=
        value[kMass] + s.velocity * (value[kSlowing] + slope[kMass] * speed) -
        s.position * (drive.part * slope[kLift] + drive.bodies_air * slope[kBlown]);
    return !(height_ < tables.breaks.front() || height_ > tables.breaks.back());
}

}  // namespace catenary
