// A head over a reduced mechanism.
#include "heads/raised_head.hpp"

#include <array>
#include <stdexcept>

namespace catenary {

namespace {

/// Columns of the tables; the last one may be missing.
enum Column { kMass, kLift, kSlowing, kCarried, kBlown, kMostColumns };

}  // namespace

RaisedHead::RaisedHead(const HeadArrays& arrays, const SprungMasses& masses, const HeadLaws& laws,
                       const ReducedMechanism& mechanism)
    : SprungHead(arrays, masses, laws), mechanism_(mechanism) {
    const SplineTables& tables = mechanism.tables;
    if (tables.coefficients.rows < kBlown || tables.coefficients.rows > kMostColumns ||
        size(tables.breaks) < 2 || tables.coefficients.n != size(tables.breaks) - 1 ||
        tables.coefficients.columns != 4)
        throw std::invalid_argument("a mechanism's tables have other shapes");
}

bool RaisedHead::step_free(const Drive& drive) {
    begin(drive);
    const SplineTables& tables = mechanism_.tables;
    const int64_t last = n() - 1;
    const NewmarkFactors& s = newmark();
    height_ = predicted()[last] - mechanism_.zero - drive.base;
    const double speed = predicted_velocity()[last] - drive.base_velocity;
    std::array<double, kMostColumns> value{}, slope{};
    const int64_t m = tables.coefficients.rows;
    tables_at(tables, height_, std::span(value).first(m), std::span(slope).first(m));
    double& force = this->force()[last];
    force += drive.part * (value[kLift] - mechanism_.weight) + added(drive) -
             value[kSlowing] * speed - 0.5 * slope[kMass] * speed * speed;
    // The base carries the mechanism along, but less mass than the raised one if parts stay low.
    force += (value[kMass] - value[kCarried]) * drive.base_acceleration;
    force += drive.arm_air + drive.bodies_air * value[kBlown];
    matrix()(last, last) +=
        value[kMass] + s.velocity * (value[kSlowing] + slope[kMass] * speed) -
        s.position * (drive.part * slope[kLift] + drive.bodies_air * slope[kBlown]);
    finish(drive);
    return !(height_ < tables.breaks.front() || height_ > tables.breaks.back());
}

}  // namespace catenary
