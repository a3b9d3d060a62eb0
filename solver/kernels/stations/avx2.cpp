#include "stations/targets.hpp"
#ifdef CATENARY_X86_TARGETS
#pragma GCC target("arch=x86-64-v3")
#define CATENARY_TARGET avx2
#define CATENARY_TARGET_HAS_AVX
#include "stations/scene_blocks.hpp"
#endif
