#pragma once
// Loops of vector instructions, compiled for several processors: the loader takes the best one.
// With -O2 alone GCC vectorises only loops whose length it knows.
#if defined(__x86_64__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__)
#define CATENARY_FOR_TARGETS                                                     \
    __attribute__((target_clones("default", "arch=x86-64-v3", "arch=x86-64-v4"), \
                   optimize("vect-cost-model=dynamic")))
#else
#define CATENARY_FOR_TARGETS
#endif
