// Which compilers the kernels are written for; every other one is refused in a sentence.
#pragma once

#if defined(__clang__)
#if __clang_major__ < 16
#error "The kernels of Catenary need a C++20 compiler: Clang 16 or newer, or GCC 12 or newer."
#endif
#elif defined(__GNUC__)
#if __GNUC__ < 12
#error "The kernels of Catenary need a C++20 compiler: GCC 12 or newer, or Clang 16 or newer."
#endif
#endif
