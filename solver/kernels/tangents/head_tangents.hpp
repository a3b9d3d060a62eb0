#pragma once
// Derivatives of the heads' steps by parameters of a march.
#include <vector>

#include "heads/head.hpp"

namespace catenary {

/// Derivatives of a head: of its state (3 n,), which goes on with the steps, and of the step
/// itself. Of a linear chain these are all of its arrays or none; others are made anew with the
/// parameter a `step` lower and a step higher, or not at all.
struct HeadChange {
    Array2<const double> matrix;
    std::span<const double> by_drive, by_head;
    Array2<const double> inverse;
    std::span<double> state;
    std::vector<Head*> beside;
    double step;
    CATENARY_RECORD(matrix, by_drive, by_head, inverse, state, beside, step)
    CATENARY_SHAPES("3n 3n?, 3n?, 3n?, n n?, 3n")
};

/// Derivatives of gaps and of their rates at n contacts, without changes of contact forces (n,).
struct GapChange {
    std::span<double> place, rate;
};

/// Differentiates the steps of a train's heads.
class HeadTangents {
  public:
    /// Of each head that is no linear chain, `pairs` has two copies, for changed states; `force`
    /// are the contact forces of the latest step. Throws std::invalid_argument if copies are
    /// missing.
    HeadTangents(std::vector<Head*> heads, std::vector<std::vector<Head*>> pairs,
                 std::span<const double> force);
    size_t n() const { return heads_.size(); }
    /// Keep the states before a step.
    void keep();
    /// Differentiate the step of each head without changes of contact forces, by the rows that
    /// drove the heads and their derivatives, no rows if these do not change. Heights and rates of
    /// the strips are added to `gaps`.
    void predict(std::span<const HeadChange> changes, const Array2<double>& drives,
                 const Array2<const double>& changed, const GapChange& gaps);
    /// Move the derivatives of the states by those of contact forces (n,).
    void move(std::span<const HeadChange> changes, std::span<const double> forces) const;
    /// Derivative of the mean height of a head's strips.
    double height(size_t h, const HeadChange& change) const;

  private:
    void step_chain(const HeadChange& change, const Drive& drive, const Drive& changed, size_t h,
                    const GapChange& gaps);
    void step_beside(const HeadChange& change, std::span<const double> drive,
                     std::span<const double> changed, size_t h, const GapChange& gaps);
    void take_step(Head& head, std::span<const double> drive, size_t h) const;
    bool is_straight(size_t h) const;
    void add_end(const Head& head, size_t h, double weight, const GapChange& gaps);
    void add_places(std::span<const double> state, size_t h, double weight,
                    const GapChange& gaps) const;
    void put_state(Head& head, size_t h) const;

    std::vector<Head*> heads_;
    std::vector<std::vector<Head*>> pairs_;
    std::span<const double> force_;
    std::vector<std::vector<double>> before_;   ///< states before the step
    std::vector<std::vector<double>> pressed_;  ///< contact forces that their laws read then
    std::vector<std::vector<double>> free_;     ///< derivatives of states without contact
    std::vector<double> row_;                   ///< room for the drive of a head
};

}  // namespace catenary
