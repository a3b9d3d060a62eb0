#include "stations/before_target.hpp"
#if defined(__x86_64__) && !defined(__clang__)
#pragma GCC target("arch=x86-64-v3")
#define CATENARY_TARGET avx2
#include "stations/target.hpp"
#endif
