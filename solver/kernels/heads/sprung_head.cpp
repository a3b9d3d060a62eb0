// Heads whose matrix is made anew in each step.
#include "heads/sprung_head.hpp"

#include <stdexcept>

#include "base/inverse.hpp"

namespace catenary {

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
        laws_.settle(
            {position_, velocity_, acceleration(), touch(), drive.base, drive.base_velocity},
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
    respond({matrix.data, n, n});
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
