// Chains of lumped masses, and heads whose matrix is made anew in each step.
#include "heads/chains.hpp"

#include <stdexcept>

#include "base/inverse.hpp"

namespace catenary {

LinearChain::LinearChain(const HeadArrays& arrays, const LinearStep& linear)
    : Head(arrays), linear_(linear) {
    const int64_t n = this->n();
    if (linear.matrix.rows != 3 * n || linear.matrix.columns != 3 * n ||
        size(linear.by_drive) != 3 * n || size(linear.by_head) != 3 * n ||
        linear.inverse.rows != n || linear.inverse.columns != n)
        throw std::invalid_argument("a linear step has other coordinates than its head");
}

bool LinearChain::step_free(const Drive& drive) {
    const auto now = state();
    const auto after = free();
    const double lift = drive.force + added(drive);
    for (int64_t i = 0; i < size(now); ++i) {
        double value = lift * linear_.by_drive[i] + drive.head_air * linear_.by_head[i];
        const auto row = linear_.matrix[i];
        for (int64_t k = 0; k < size(now); ++k) value += row[k] * now[k];
        after[i] = value;
    }
    respond(linear_.inverse);
    return true;
}

SprungHead::SprungHead(const HeadArrays& arrays, const SprungMasses& masses, const HeadLaws& laws)
    : Head(arrays),
      masses_(masses),
      laws_(laws, n()),
      position_(n()),
      velocity_(n()),
      force_(n()),
      matrix_(n() * n()) {
    const int64_t n = this->n();
    if (size(masses.masses) != n || size(masses.push) != n || masses.stiffness.rows != n ||
        masses.stiffness.columns != n || masses.damping.rows != n || masses.damping.columns != n ||
        size(laws.pressed) != n_strips())
        throw std::invalid_argument("masses and springs have other coordinates than their head");
}

void SprungHead::begin(const Drive& drive) {
    const int64_t n = this->n();
    const NewmarkFactors& s = newmark();
    const auto q = position(), v = velocity(), a = acceleration();
    const auto &stiffness = masses_.stiffness, &damping = masses_.damping;
    for (int64_t i = 0; i < n; ++i) {
        position_[i] = q[i] + s.dt * v[i] + s.predict_position * a[i];
        velocity_[i] = v[i] + s.predict_velocity * a[i];
    }
    const Array2<double> matrix = this->matrix();
    for (int64_t i = 0; i < n; ++i) {
        double value = 0.0;
        for (int64_t k = 0; k < n; ++k) {
            value -= stiffness(i, k) * position_[k] + damping(i, k) * velocity_[k];
            matrix(i, k) = s.velocity * damping(i, k) + s.position * stiffness(i, k);
        }
        force_[i] = value + drive.head_air * masses_.push[i];
        matrix(i, i) += masses_.masses[i];
    }
}

void SprungHead::finish(const Drive& drive) {
    const int64_t n = this->n();
    const Array2<double> matrix = this->matrix();
    if (laws_.any())
        laws_.settle({position_, velocity_, acceleration(), touch(), drive.base,
                      drive.base_velocity, drive.roof, drive.roof_velocity},
                     newmark(), force_, matrix);
    else
        invert(matrix);
    const auto after = free();
    for (int64_t i = 0; i < n; ++i) {
        double acceleration = 0.0;
        for (int64_t k = 0; k < n; ++k) acceleration += matrix(i, k) * force_[k];
        after[i] = position_[i] + newmark().position * acceleration;
        after[n + i] = velocity_[i] + newmark().velocity * acceleration;
        after[2 * n + i] = acceleration;
    }
    respond(matrix);
}

void SprungHead::remember(std::span<const double> contact_force) {
    if (laws_.any()) laws_.press(contact_force);
}

LawfulChain::LawfulChain(const HeadArrays& arrays, const SprungMasses& masses, const HeadLaws& laws,
                         int64_t carrier)
    : SprungHead(arrays, masses, laws), carrier_(carrier) {
    if (carrier < 0 || carrier >= n())
        throw std::invalid_argument("a chain is driven at one of its coordinates");
}

bool LawfulChain::step_free(const Drive& drive) {
    begin(drive);
    force()[carrier_] += drive.force + added(drive);
    finish(drive);
    return true;
}

}  // namespace catenary
