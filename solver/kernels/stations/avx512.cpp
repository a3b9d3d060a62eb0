// Vectors of four numbers as for AVX2, in twice as many registers, and products that read the
// number which they broadcast: wider ones read no less memory. Only eight scenes stand in vectors
// of eight.
#include "stations/targets.hpp"
#ifdef CATENARY_X86_TARGETS
#pragma GCC target("arch=x86-64-v4", "prefer-vector-width=256")
#define CATENARY_TARGET avx512
#define CATENARY_TARGET_HAS_AVX
#define CATENARY_TARGET_HAS_AVX512
#include "stations/scene_blocks.hpp"
#endif
