#pragma once
// Arrays of others, which these do not own: std::span of one dimension, and more below; and records
// of arrays, which Python fills in by the names of their members. Bounds are checked where
// _GLIBCXX_ASSERTIONS is defined, and numbers where CATENARY_CHECKS is, as by `make sanitize`.
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <span>
#include <stdexcept>
#include <tuple>
#include <type_traits>

/// Names the members of a record, last in it. Python has a named tuple of these.
#define CATENARY_RECORD(...)                              \
    static constexpr const char* kMembers = #__VA_ARGS__; \
    auto members() {                                      \
        return std::tie(__VA_ARGS__);                     \
    }

/// Shapes that arrays from Python must have, member by member, in the words of
/// python/from_python.hpp.
#define CATENARY_SHAPES(shapes) static constexpr const char* kShapes = shapes;

namespace catenary {

/// A table (rows, columns), row by row.
template <class T>
struct Array2 {
    T* data = nullptr;
    int64_t rows = 0, columns = 0;
    auto sizes() { return std::tie(rows, columns); }

    operator Array2<const T>() const
        requires(!std::is_const_v<T>)
    {
        return {data, rows, columns};
    }
    std::span<T> operator[](int64_t row) const { return all().subspan(row * columns, columns); }
    T& operator()(int64_t row, int64_t column) const { return (*this)[row][column]; }
    std::span<T> all() const { return {data, static_cast<size_t>(rows * columns)}; }
};

/// Tables (n, rows, columns), one after another.
template <class T>
struct Array3 {
    T* data = nullptr;
    int64_t n = 0, rows = 0, columns = 0;
    auto sizes() { return std::tie(n, rows, columns); }

    Array2<T> operator[](int64_t number) const {
        return {all().subspan(number * rows * columns, rows * columns).data(), rows, columns};
    }
    T& operator()(int64_t number, int64_t row, int64_t column) const {
        return (*this)[number](row, column);
    }
    std::span<T> all() const { return {data, static_cast<size_t>(n * rows * columns)}; }
};

/// How many numbers there are, as an index may count.
template <class T>
int64_t size(std::span<T> array) {
    return static_cast<int64_t>(array.size());
}
/// The numbers from `begin` to before `end`. Throws std::out_of_range if there are not as many.
template <class T>
std::span<T> part(std::span<T> array, int64_t begin, int64_t end) {
    if (begin < 0 || end < begin || end > size(array))
        throw std::out_of_range("a part of an array is beyond its numbers");
    return array.subspan(begin, end - begin);
}

template <class T>
concept RecordType = requires(T record) {
    T::kMembers;
    record.members();
};
/// One of these arrays of more than one dimension.
template <class T>
concept TableType = requires(T table) { table.sizes(); };

/// Invert in place a matrix (n, n) that needs no exchange of rows: a positive definite one, or one
/// whose masses outweigh all else.
inline void invert(Array2<double> matrix) {
    const int64_t n = matrix.rows;
    for (int64_t k = 0; k < n; ++k) {
        const auto row = matrix[k];
        const double pivot = 1.0 / row[k];
        row[k] = 1.0;
        for (int64_t j = 0; j < n; ++j) row[j] *= pivot;
        for (int64_t i = 0; i < n; ++i) {
            if (i == k) continue;
            const auto other = matrix[i];
            const double share = other[k];
            other[k] = 0.0;
            for (int64_t j = 0; j < n; ++j) other[j] -= share * row[j];
        }
    }
}

/// End the program, with a sentence, if one of these is no finite number.
inline void check_numbers([[maybe_unused]] std::span<const double> numbers,
                          [[maybe_unused]] const char* of) {
#ifdef CATENARY_CHECKS
    for (size_t i = 0; i < numbers.size(); ++i)
        if (numbers[i] - numbers[i] != 0.0) {  // infinity less itself is no number
            std::fprintf(stderr, "catenary: number %zu of %s is %g\n", i, of, numbers[i]);
            std::abort();
        }
#endif
}

}  // namespace catenary
