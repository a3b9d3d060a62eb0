// Bands of complex numbers factored row by row, Fourier transforms by halves, and sums over the
// past, near lags one by one and far ones by these transforms; loads in time, evaluated; waves of
// gusts.
#include "loads/loads.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <stdexcept>
#include <vector>

#include "base/curves.hpp"
#include "base/targets.hpp"

namespace catenary {

namespace {

/// M, C and K of a span at a frequency.
struct Weighted {
    Complex of_mass, of_damping, of_stiffness;

    Complex operator()(const Array3<const double>& matrices, int64_t row, int64_t column) const {
        return product(of_mass, matrices(0, row, column)) +
               product(of_damping, matrices(1, row, column)) +
               product(of_stiffness, matrices(2, row, column));
    }
};

/// The first row in which each column is not zero.
std::vector<int64_t> begins_of(const Array3<const double>& beside) {
    std::vector<int64_t> begins(beside.columns, beside.rows);
    for (int64_t j = 0; j < beside.columns; ++j)
        for (int64_t r = 0; r < beside.rows && begins[j] == beside.rows; ++r)
            if (beside(0, r, j) != 0.0 || beside(1, r, j) != 0.0 || beside(2, r, j) != 0.0)
                begins[j] = r;
    return begins;
}

/// Room for one span.
struct Room {
    std::vector<Complex> lower;    ///< (n, b) rows of L D, the last number beside the diagonal
    std::vector<Complex> inverse;  ///< (n,) 1 / D
    std::vector<Complex> forth;    ///< (n, k) inverse(L) beside
    std::vector<Complex> row;      ///< (b,) the row of L alone that is worked on
};

/// Factor row r, whose numbers begin at column r - width; `first` is its first column that exists.
void factor_row(const Weighted& weighted, const Array3<const double>& bands, int64_t r,
                int64_t first, Room& room) {
    const int64_t width = bands.columns - 1;
    for (int64_t q = first; q <= r; ++q) {
        const int64_t d = width - (r - q);
        Complex total = weighted(bands, r, d);
        const Complex* other = q < r ? &room.lower[q * width] : &room.lower[r * width];
        for (int64_t p = std::max(first, q - width); p < q; ++p)
            total -= product(room.row[width - (r - p)], other[width - (q - p)]);
        if (q == r) {
            room.inverse[r] = 1.0 / total;
        } else {
            room.lower[r * width + d] = total;
            room.row[d] = product(total, room.inverse[q]);
        }
    }
}

}  // namespace

void condense_spans(Array2<const Complex> weights, Array3<const double> bands,
                    Array3<const double> beside, Array3<Complex> taken) {
    const int64_t n = bands.rows, width = bands.columns - 1, k = beside.columns;
    const auto begins = begins_of(beside);
    Room room;
    room.lower.resize(n * width);
    room.inverse.resize(n);
    room.forth.resize(n * k);
    room.row.resize(width);
    for (int64_t z = 0; z < weights.rows; ++z) {
        const Weighted weighted{weights(z, 0), weights(z, 1), weights(z, 2)};
        for (int64_t r = 0; r < n; ++r) {
            const int64_t first = std::max<int64_t>(0, r - width);
            factor_row(weighted, bands, r, first, room);
            Complex* const forth = &room.forth[r * k];
            for (int64_t j = 0; j < k; ++j) {
                forth[j] = {};
                if (r < begins[j]) continue;
                Complex right = weighted(beside, r, j);
                for (int64_t q = std::max(first, begins[j]); q < r; ++q)
                    right -= product(room.row[width - (r - q)], room.forth[q * k + j]);
                forth[j] = right;
            }
            for (int64_t i = 0; i < k; ++i) {
                const Complex share = product(forth[i], room.inverse[r]);
                for (int64_t j = i; j < k; ++j) taken(z, i, j) += product(share, forth[j]);
            }
        }
        for (int64_t i = 0; i < k; ++i)
            for (int64_t j = 0; j < i; ++j) taken(z, i, j) = taken(z, j, i);
    }
}

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

namespace {

/// A function of time of this kind.
double value_at(double time, int64_t kind, std::span<const double> numbers) {
    if (kind == kConstant) return numbers[0];
    if (kind == kTable) {
        const size_t n = numbers.size() / 2;
        return line_at(numbers.first(n), numbers.subspan(n), time).first;
    }
    double total = numbers[0];
    for (size_t i = 1; i + 2 < numbers.size(); i += 3) {
        const double frequency = numbers[i], amplitude = numbers[i + 1], phase = numbers[i + 2];
        total += amplitude * std::cos(frequency * time + phase);
    }
    return total;
}

/// Fill in the forces that change by factors.
void put_changing(double time, const Changing& changing, std::span<const double> constant,
                  std::span<double> values) {
    for (Factor& factor : changing.factors)
        factor.value =
            value_at(time, factor.kind, part(changing.numbers, factor.begin, factor.end));
    for (int64_t j = 0; j < size(changing.places); ++j) {
        const int64_t place = changing.places[j];
        double total = constant[place];
        for (int64_t e = changing.begins[j]; e < changing.begins[j + 1]; ++e)
            total += changing.factors[changing.terms[e]].value * changing.forces[e];
        values[place] = total;
    }
}

/// Add loads that are linear in time between slices.
void add_samples(double time, const Sampled& sampled, std::span<double> values) {
    for (const SampledLoad& load : sampled.loads) {
        const int64_t n = load.last - load.first;
        const auto places = sampled.places.subspan(load.first, n);
        const auto times = sampled.times.subspan(load.times, load.held);
        const int64_t after = std::upper_bound(times.begin(), times.end(), time) - times.begin();
        const int64_t i = std::max<int64_t>(0, after - 1);
        const auto here = sampled.samples.subspan(load.samples + i * n, n);
        if (i + 1 == load.held || times[i] >= time) {
            for (int64_t j = 0; j < n; ++j) values[places[j]] += here[j];
            continue;
        }
        const auto then = sampled.samples.subspan(load.samples + (i + 1) * n, n);
        const double share = (time - times[i]) / (times[i + 1] - times[i]);
        for (int64_t j = 0; j < n; ++j)
            values[places[j]] += (1.0 - share) * here[j] + share * then[j];
    }
}

}  // namespace

void evaluate(const Loads& loads) {
    const double time = loads.clock[0];
    if (!std::isfinite(time)) throw std::invalid_argument("the time of loads is no number");
    put_changing(time, loads.changing, loads.constant, loads.values);
    add_samples(time, loads.sampled, loads.values);
    remember(time, loads.values, loads.memories);
}

CATENARY_FOR_TARGETS
void add_waves(Array2<const double> waves, Array2<const double> amplitudes, Array2<double> out) {
    for (int64_t i = 0; i < waves.rows; ++i) {
        const auto result = out[i];
        for (int64_t j = 0; j < waves.columns; ++j) {
            const double factor = waves(i, j);
            const auto amplitude = amplitudes[j];
            for (size_t p = 0; p < result.size(); ++p) result[p] += factor * amplitude[p];
        }
    }
}

}  // namespace catenary
