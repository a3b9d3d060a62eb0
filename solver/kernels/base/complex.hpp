#pragma once
// Products of complex numbers without the checks for infinity, so that loops are vectorised.
#include <complex>

namespace catenary {

using Complex = std::complex<double>;

inline Complex product(Complex one, Complex other) {
    return {one.real() * other.real() - one.imag() * other.imag(),
            one.real() * other.imag() + one.imag() * other.real()};
}
inline Complex product(Complex one, double other) {
    return {one.real() * other, one.imag() * other};
}

}  // namespace catenary
