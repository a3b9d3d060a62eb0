#pragma once
// Checks besides bounds in builds that search for faults (`build_ext --sanitize`).
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "base/arrays.hpp"

namespace catenary {

/// End the program, with a sentence, if one of these is no finite number.
inline void check_numbers([[maybe_unused]] std::span<const double> numbers,
                          [[maybe_unused]] const char* of) {
#ifdef CATENARY_CHECKS
    for (size_t i = 0; i < numbers.size(); ++i)
        if (!std::isfinite(numbers[i])) {
            std::fprintf(stderr, "catenary: number %zu of %s is %g\n", i, of, numbers[i]);
            std::abort();
        }
#endif
}

}  // namespace catenary
