#pragma once
// A chain of lumped masses with laws that are not linear.
#include "heads/sprung_head.hpp"

namespace catenary {

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
