// A chain of lumped masses with laws that are not linear.
#include "heads/lawful_chain.hpp"

#include <stdexcept>

namespace catenary {

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
