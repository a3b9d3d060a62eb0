#pragma once
// Targets of kernels: any processor, and besides processors with AVX2 and with AVX-512 where a
// pragma of the compiler can name them. Kernels that check each access are for
// any: each target takes minutes and gigabytes to compile with checks, and the source is the same.
//
// Headers that are the same for all targets come first: their functions must not be built for one.
#include <algorithm>
#include <array>
#include <cstdint>
#include <iterator>
#include <memory>
#include <type_traits>
#include <utility>
#include <vector>

#include "stations/known_layouts.hpp"
#include "stations/line.hpp"

#if defined(__x86_64__) && !defined(__clang__) && !defined(CATENARY_CHECKS)
#define CATENARY_X86_TARGETS
#endif
