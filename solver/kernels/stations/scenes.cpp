// Kernels of several scenes side by side, where processors have the vectors for it.
#include "stations/before_target.hpp"
#if defined(__x86_64__) && !defined(__clang__)
#pragma GCC target("arch=x86-64-v3")
#define CATENARY_TARGET avx2
#else
#define CATENARY_TARGET baseline
#endif
#include "stations/scene_blocks.hpp"
