// Steps of heads without contact: of linear chains, and of masses whose matrix is made anew.
#include <algorithm>
#include <array>

#include "heads/head.hpp"

namespace catenary {

bool Head::step_free(const Drive& drive) {
    if (!parts_.linear) return step_sprung(drive);
    step_linear(drive);
    return true;
}

void Head::remember(std::span<const double> contact_force) {
    if (laws_) std::ranges::copy(contact_force, parts_.sprung->laws.pressed.begin());
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
