#include "stations/before_target.hpp"
#define CATENARY_TARGET baseline
#if defined(__x86_64__) && !defined(__clang__)
#define CATENARY_GENERAL_ONLY
#endif
#include "stations/target.hpp"
