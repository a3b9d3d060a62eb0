#pragma once
// Chains of lumped masses: on linear springs and dampers, or with laws. The matrix of the latter is
// made anew in each step, as that of heads over a mechanism.
#include <vector>

#include "heads/head.hpp"
#include "heads/laws.hpp"

namespace catenary {

/// A step without contact, with forces F: new state = matrix @ state + F by_drive + F_head by_head.
struct LinearStep {
    Array2<const double> matrix;       ///< (3 n, 3 n)
    std::span<const double> by_drive;  ///< (3 n,) of the force on the last mass
    std::span<const double> by_head;   ///< (3 n,) of that on the head
    Array2<const double> inverse;      ///< (n, n) of the matrix that gives accelerations
    CATENARY_RECORD(matrix, by_drive, by_head, inverse)
    CATENARY_SHAPES("k k, k, k")
};

class LinearChain : public Head {
  public:
    LinearChain(const HeadArrays& arrays, const LinearStep& linear);
    const LinearStep& linear() const { return linear_; }

  protected:
    bool step_free(const Drive& drive) override;

  private:
    LinearStep linear_;
};

/// Masses on linear springs and dampers.
struct SprungMasses {
    std::span<const double> masses;           ///< (n,)
    Array2<const double> stiffness, damping;  ///< (n, n)
    std::span<const double> push;  ///< (n,) force on each coordinate by an upward unit force on the
                                   ///< strips' middle
    CATENARY_RECORD(masses, stiffness, damping, push)
    CATENARY_SHAPES("n, n n, n n, n")
};

class SprungHead : public Head {
  public:
    SprungHead(const HeadArrays& arrays, const SprungMasses& masses, const HeadLaws& laws);
    const SprungMasses& masses() const { return masses_; }
    const HeadLaws& laws() const { return laws_.laws(); }

  protected:
    /// Predict (paper eq. 2.5), and put force and matrix of springs, dampers, masses and the air.
    void begin(const Drive& drive);
    /// Add laws, find accelerations, and fill in state and answers without contact.
    void finish(const Drive& drive);
    void remember(std::span<const double> contact_force) override;

    std::span<const double> predicted() const { return position_; }
    std::span<const double> predicted_velocity() const { return velocity_; }
    std::span<double> force() { return force_; }
    Array2<double> matrix() { return {matrix_.data(), n(), n()}; }

  private:
    SprungMasses masses_;
    SettlingLaws laws_;
    std::vector<double> position_, velocity_, force_, matrix_;
};

/// A chain of lumped masses with laws that are not linear.
class LawfulChain : public SprungHead {
  public:
    /// `carrier` is the coordinate that is driven.
    LawfulChain(const HeadArrays& arrays, const SprungMasses& masses, const HeadLaws& laws,
                int64_t carrier);
    int64_t carrier() const { return carrier_; }

  protected:
    bool step_free(const Drive& drive) override;

  private:
    int64_t carrier_;
};

}  // namespace catenary
