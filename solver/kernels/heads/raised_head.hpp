#pragma once
// A head over a reduced mechanism, whose height is the last coordinate. See
// mbs/mechanism/reduced_pantograph.py.
#include "heads/chains.hpp"

namespace catenary {

struct ReducedMechanism {
    SplineTables tables;  ///< mass [kg], lift [N], damping [N s/m], carried mass [kg] and, of some,
                          ///< lift by the air [N], over the mechanism's height [m]
    double weight;        ///< of the head [N]
    double zero;          ///< the coordinate where the mechanism's height is zero [m]
    CATENARY_RECORD(tables, weight, zero)
};

class RaisedHead : public SprungHead {
  public:
    RaisedHead(const HeadArrays& arrays, const SprungMasses& masses, const HeadLaws& laws,
               const ReducedMechanism& mechanism);
    const ReducedMechanism& mechanism() const { return mechanism_; }
    /// Height at which the tables were taken in the latest step [m].
    double height() const { return height_; }

  protected:
    /// Whether that height is within the tables; NaN passes, for the coupling to find.
    bool step_free(const Drive& drive) override;

  private:
    ReducedMechanism mechanism_;
    double height_ = 0.0;
};

}  // namespace catenary
