#pragma once
// Fourier transforms in place whose length is a power of two.
#include <span>

#include "base/complex.hpp"

namespace catenary {

/// Transform numbers in place, into the order of reversed bits. `turns` hold exp(-i pi k / h)
/// at h + k for each power h below the length.
void fourier_forth(std::span<Complex> numbers, std::span<const Complex> turns);
/// Transform the result of `fourier_forth` back into the numbers, times their count.
void fourier_back(std::span<Complex> numbers, std::span<const Complex> turns);

}  // namespace catenary
