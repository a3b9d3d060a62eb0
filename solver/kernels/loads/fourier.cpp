// Fourier transforms by halves.
#include "loads/fourier.hpp"

#include <bit>
#include <cstdint>
#include <stdexcept>

#include "base/targets.hpp"

namespace catenary {

namespace {

/// Real and imaginary parts in turn.
double* parts_of(Complex* numbers) {
    return reinterpret_cast<double*>(numbers);
}

void check(std::span<const Complex> numbers, std::span<const Complex> turns) {
    if (!std::has_single_bit(numbers.size()) || turns.size() < numbers.size())
        throw std::invalid_argument(
            "a Fourier transform has a power of two numbers, and as many turns");
}

}  // namespace

CATENARY_FOR_TARGETS
void fourier_forth(std::span<Complex> numbers, std::span<const Complex> turns) {
    const auto n = static_cast<int64_t>(numbers.size());
    check(numbers, turns);
    for (int64_t half = n / 2; half >= 1; half /= 2)
        for (int64_t start = 0; start < n; start += 2 * half) {
            double* __restrict near = parts_of(&numbers[start]);
            double* __restrict far = parts_of(&numbers[start + half]);
            const double* __restrict turn = reinterpret_cast<const double*>(&turns[half]);
            for (int64_t k = 0; k < 2 * half; k += 2) {
                const double real = near[k] - far[k], imaginary = near[k + 1] - far[k + 1];
                near[k] += far[k];
                near[k + 1] += far[k + 1];
                far[k] = real * turn[k] - imaginary * turn[k + 1];
                far[k + 1] = real * turn[k + 1] + imaginary * turn[k];
            }
        }
}

CATENARY_FOR_TARGETS
void fourier_back(std::span<Complex> numbers, std::span<const Complex> turns) {
    const auto n = static_cast<int64_t>(numbers.size());
    check(numbers, turns);
    for (int64_t half = 1; 2 * half <= n; half *= 2)
        for (int64_t start = 0; start < n; start += 2 * half) {
            double* __restrict near = parts_of(&numbers[start]);
            double* __restrict far = parts_of(&numbers[start + half]);
            const double* __restrict turn = reinterpret_cast<const double*>(&turns[half]);
            for (int64_t k = 0; k < 2 * half; k += 2) {
                const double real = far[k] * turn[k] + far[k + 1] * turn[k + 1];
                const double imaginary = far[k + 1] * turn[k] - far[k] * turn[k + 1];
                far[k] = near[k] - real;
                far[k + 1] = near[k + 1] - imaginary;
                near[k] += real;
                near[k + 1] += imaginary;
            }
        }
}

}  // namespace catenary
