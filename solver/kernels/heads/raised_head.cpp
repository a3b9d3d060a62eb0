// A head over a reduced mechanism.
#include "heads/raised_head.hpp"

#include <array>
#include <bit>
#include <stdexcept>

namespace catenary {

namespace {

/// Values of the tables at a height, in the order of their columns.
struct Columns {
    double mass, lift, slowing, carried, blown;
};
constexpr int64_t kMostColumns = sizeof(Columns) / sizeof(double), kLeastColumns = kMostColumns - 1;

/// As `tables_at` fills it in: zero where tables have no column for the air's lift.
struct Filled {
    std::array<double, kMostColumns> numbers{};
    std::span<double> first(int64_t n) { return part(std::span<double>(numbers), 0, n); }
    Columns columns() const { return std::bit_cast<Columns>(numbers); }
};

}  // namespace

RaisedHead::RaisedHead(const HeadArrays& arrays, const SprungMasses& masses, const HeadLaws& laws,
                       const ReducedMechanism& mechanism)
    : SprungHead(arrays, masses, laws), mechanism_(mechanism) {
    const SplineTables& tables = mechanism.tables;
    if (tables.coefficients.rows < kLeastColumns || tables.coefficients.rows > kMostColumns ||
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
    Filled values, slopes;
    const int64_t m = tables.coefficients.rows;
    tables_at(tables, height_, values.first(m), slopes.first(m));
    const Columns value = values.columns(), slope = slopes.columns();
    double& force = this->force()[last];
    force += drive.part * (value.lift - mechanism_.weight) + added(drive) - value.slowing * speed -
             0.5 * slope.mass * speed * speed;
    // The base carries the mechanism along, but less mass than the raised one if parts stay low.
    force += (value.mass - value.carried) * drive.base_acceleration;
    force += drive.arm_air + drive.bodies_air * value.blown;
    matrix()(last, last) += value.mass + s.velocity * (value.slowing + slope.mass * speed) -
                            s.position * (drive.part * slope.lift + drive.bodies_air * slope.blown);
    finish(drive);
    return !(height_ < tables.breaks.front() || height_ > tables.breaks.back());
}

}  // namespace catenary
