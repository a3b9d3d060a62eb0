#pragma once
// A chain of lumped masses on linear springs and dampers.
#include "heads/head.hpp"

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

}  // namespace catenary
