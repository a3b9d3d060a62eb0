#pragma once
// Which compilers the kernels are written for: every other one is refused in a sentence. And loops
// of vector instructions, compiled for several processors: the loader takes the best one. With -O2
// alone GCC vectorises only loops whose length it knows.
#if defined(__clang__) ? __clang_major__ < 16 : defined(__GNUC__) && __GNUC__ < 12
#error "The kernels of Catenary need a C++20 compiler: GCC 12 or newer, or Clang 16 or newer."
#endif

#if defined(__x86_64__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__)
#define CATENARY_FOR_TARGETS                                                     \
    __attribute__((target_clones("default", "arch=x86-64-v3", "arch=x86-64-v4"), \
                   optimize("vect-cost-model=dynamic")))
#else
#define CATENARY_FOR_TARGETS
#endif
