// Sums over the past, near lags one by one and far ones by Fourier transforms.
#include "loads/memories.hpp"

#include <algorithm>
#include <cmath>

#include "base/targets.hpp"
#include "loads/fourier.hpp"

namespace catenary {

namespace {

/// n numbers from a place on.
template <class T>
std::span<T> numbers_from(std::span<T> array, int64_t begin, int64_t n) {
    return part(array, begin, begin + n);
}

CATENARY_FOR_TARGETS
void add_scaled(std::span<double> into, const double* numbers, double factor) {
    double* const result = into.data();
    const int64_t n = size(into);
    for (int64_t k = 0; k < n; ++k) result[k] += numbers[k] * factor;
}

CATENARY_FOR_TARGETS
void add_products(std::span<Complex> into, const Complex* one, const Complex* other) {
    Complex* const result = into.data();
    const int64_t n = size(into);
    for (int64_t k = 0; k < n; ++k) result[k] += product(one[k], other[k]);
}

/// Add the terms of the last step before `step` by near lags to the sums of later steps.
void fold_near(const MemoryTables& tables, const EndMemory& end, int64_t step) {
    const int64_t m = end.width, n = end.n_steps;
    const int64_t coming = std::min(kNear - 1, n - step);
    for (int64_t i = 0; i < m; ++i) {
        const auto into = numbers_from(tables.sums, end.sums + i * n + step, coming);
        for (int64_t j = 0; j < m; ++j) {
            const double latest = tables.past[end.past + j * n + step - 1];
            const auto numbers =
                numbers_from(tables.near, end.near + (i * m + j) * kNear + 1, coming);
            add_scaled(into, numbers.data(), latest);
        }
    }
}

/// Add the terms of the `length` steps before `step` by lags of `length` to twice as many, to the
/// sums of later steps.
void fold_block(const MemoryTables& tables, const EndMemory& end, int64_t step, int64_t length,
                int64_t spectra) {
    const int64_t m = end.width, n = end.n_steps, size = 2 * length;
    for (int64_t j = 0; j < m; ++j) {
        const auto row = numbers_from(tables.room[j], 0, size);
        const auto source = numbers_from(tables.past, end.past + j * n + step - length, length);
        std::copy(source.begin(), source.end(), row.begin());
        std::fill(row.begin() + length, row.end(), Complex{});
        fourier_forth(row, tables.turns);
    }
    const auto both = numbers_from(tables.room[m], 0, size);
    const int64_t coming = std::min(size, n - step);
    for (int64_t first = 0; first < m; first += 2) {
        std::fill(both.begin(), both.end(), Complex{});
        for (int64_t j = 0; j < m; ++j) {
            const auto spectrum =
                numbers_from(tables.spectra, spectra + (first / 2 * m + j) * size, size);
            add_products(both, spectrum.data(), tables.room[j].data());
        }
        fourier_back(both, tables.turns);
        const auto sums = numbers_from(tables.sums, end.sums + first * n + step, coming);
        for (int64_t k = 0; k < coming; ++k) sums[k] += both[k].real();
        if (first + 1 == m) continue;
        const auto others = numbers_from(tables.sums, end.sums + (first + 1) * n + step, coming);
        for (int64_t k = 0; k < coming; ++k) others[k] += both[k].imag();
    }
}

/// Add the terms of the last step before `step` by near lags, and of blocks of steps that end there
/// by far ones, to the sums of later steps.
void fold(const MemoryTables& tables, const EndMemory& end, int64_t step) {
    fold_near(tables, end, step);
    int64_t length = kNear, spectra = end.spectra;
    for (int64_t level = 0; level < end.levels && step % length == 0; ++level) {
        fold_block(tables, end, step, length, spectra);
        spectra += (end.width + 1) / 2 * end.width * 2 * length;
        length *= 2;
    }
}

}  // namespace

void remember(double time, std::span<double> values, const Memories& memories) {
    const MemoryTables& tables = memories.tables;
    int64_t first = 0;
    for (EndMemory& end : tables.ends) {
        const int64_t m = end.width, n = end.n_steps;
        const auto step = static_cast<int64_t>(std::nearbyint(time / end.dt));
        if (step > end.done) {
            if (step <= n) {
                for (int64_t i = 0; i < m; ++i) {
                    const int64_t at = memories.own[first + i];
                    numbers_from(tables.past, end.past + i * n + step - 1, 1)[0] =
                        memories.shares[0] * memories.latest[at] +
                        memories.shares[1] * memories.known[at];
                }
                fold(tables, end, step);
            }
            end.done = step;
        }
        if (step < n)
            for (int64_t i = 0; i < m; ++i)
                values[memories.into[first + i]] -=
                    numbers_from(tables.sums, end.sums + i * n + step, 1)[0];
        first += m;
    }
}

void recall(const MemoryTables& tables, int64_t n_steps) {
    std::fill(tables.sums.begin(), tables.sums.end(), 0.0);
    for (EndMemory& end : tables.ends) {
        for (int64_t step = 1; step <= std::min(n_steps, end.n_steps); ++step)
            fold(tables, end, step);
        end.done = n_steps;
    }
}

}  // namespace catenary
