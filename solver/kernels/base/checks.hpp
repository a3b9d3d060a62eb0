#pragma once
// What builds that look for faults check besides bounds (`build_ext --sanitize`).
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "base/arrays.hpp"

namespace catenary {

#ifdef CATENARY_CHECKS
inline constexpr bool kChecks = true;
#else
inline constexpr bool kChecks = false;
#endif

/// End the program, with a sentence, if one of these is no finite number.
inline void check_numbers(std::span<const double> numbers, const char* of) {
    if (!kChecks) return;
    for (size_t i = 0; i < numbers.size(); ++i)
        if (!std::isfinite(numbers[i])) {
            std::fprintf(stderr, "catenary: number %zu of %s is %g\n", i, of, numbers[i]);
            std::abort();
        }
}

}  // namespace catenary
