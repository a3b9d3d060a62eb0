#pragma once
// Fourier transforms in place whose length is a power of two.
#include <span>

#include "base/complex.hpp"

namespace catenary {

/// Transform numbers, which are in the order of reversed bits then. `turns` hold exp(-i pi k / h)
/// at h + k for each power h below the length.
void fourier_forth(std::span<Complex> numbers, std::span<const Complex> turns);
/// From what `fourier_forth` leaves back to the numbers, times their count.
void fourier_back(std::span<Complex> numbers, std::span<const Complex> turns);

}  // namespace catenary
