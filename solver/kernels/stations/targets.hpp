#pragma once
// Targets of kernels: any processor, and besides processors with AVX2 and with AVX-512 where a
// pragma of the compiler can name them. Kernels that check each access are for
// any: each target takes minutes and gigabytes to compile with checks, and the source is the same.
#if defined(__x86_64__) && !defined(__clang__) && !defined(CATENARY_CHECKS)
#define CATENARY_X86_TARGETS
#endif
