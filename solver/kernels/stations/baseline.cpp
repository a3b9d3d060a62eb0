#include "stations/targets.hpp"
#define CATENARY_TARGET baseline
#ifdef CATENARY_X86_TARGETS
#define CATENARY_GENERAL_ONLY
#pragma GCC optimize("O1")  // in two thirds of the time; steps take 1.06 to 1.14 as long
#else
#include "stations/scene_blocks.hpp"
#endif
#include "stations/passes.hpp"

#ifdef CATENARY_X86_TARGETS
namespace catenary::baseline {

/// None: vectors are too short for it.
std::unique_ptr<Kernels> make_for_scenes(const Layout&, const Layout&, int) {
    return nullptr;
}

}  // namespace catenary::baseline
#endif
