#pragma once
// The unknowns of a station in vectors of the processor. Included once for each target.
#ifndef CATENARY_TARGET
#error "include this from a target"
#endif
#include <type_traits>
#include <utility>

#include "stations/layout.hpp"

namespace catenary::CATENARY_TARGET {

// A function that is not put in the place of its call keeps vectors in memory.
#define CATENARY_INLINE inline __attribute__((always_inline))
#define CATENARY_HOT __attribute__((always_inline))

template <int N>
struct VectorOf {
    typedef double type __attribute__((vector_size(8 * N)));
    typedef double in_memory __attribute__((vector_size(8 * N), aligned(8)));
};
template <int N>
using Vector = typename VectorOf<N>::type;

template <int... I>
using Numbers = std::integer_sequence<int, I...>;
template <int N>
using Below = std::make_integer_sequence<int, N>;

/// Call a function with each number below N as a constant.
template <int N, class F>
CATENARY_INLINE constexpr void each(F&& function) {
    [&]<int... I>(Numbers<I...>)
        CATENARY_HOT { (function(std::integral_constant<int, I>{}), ...); }(Below<N>{});
}

/// `Size` numbers from a place on, and zeros behind them.
template <int Wide, int Size>
CATENARY_INLINE Vector<Wide> read(const double* from) {
    const Vector<Size> some = *reinterpret_cast<const typename VectorOf<Size>::in_memory*>(from);
    if constexpr (Size == Wide)
        return some;
    else
        return [&]<int... I>(Numbers<I...>) CATENARY_HOT {
            return __builtin_shufflevector(some, Vector<Size>{}, (I < Size ? I : Size)...);
        }(Below<Wide>{});
}
/// Write the first `Size` numbers.
template <int Wide, int Size>
CATENARY_INLINE void write(double* to, Vector<Wide> x) {
    using Into = typename VectorOf<Size>::in_memory;
    if constexpr (Size == Wide)
        *reinterpret_cast<Into*>(to) = x;
    else
        *reinterpret_cast<Into*>(to) = [&]<int... I>(Numbers<I...>) CATENARY_HOT {
            return __builtin_shufflevector(x, x, I...);
        }(Below<Size>{});
}

/// N vectors of so many lanes.
template <int N, int Wide>
struct Lanes {
    Vector<Wide> piece[N];

    Lanes() = default;
    // Piece by piece: compilers copy a whole one in numbers of other sizes, by way of memory.
    CATENARY_INLINE Lanes(const Lanes& y) { *this = y; }
    CATENARY_INLINE Lanes& operator=(const Lanes& y) {
        each<N>([&](auto i) CATENARY_HOT { piece[i] = y.piece[i]; });
        return *this;
    }
    CATENARY_INLINE static Lanes all(double number) {
        Lanes x;
        each<N>([&](auto i) CATENARY_HOT { x.piece[i] = number - Vector<Wide>{}; });
        return x;
    }
    CATENARY_INLINE Lanes& operator+=(const Lanes& y) {
        each<N>([&](auto i) CATENARY_HOT { piece[i] += y.piece[i]; });
        return *this;
    }
    /// This and factor y.
    CATENARY_INLINE Lanes plus(double factor, const Lanes& y) const {
        Lanes x;
        each<N>([&](auto i) CATENARY_HOT { x.piece[i] = piece[i] + factor * y.piece[i]; });
        return x;
    }
};

/// Two sums, which a processor works on side by side.
template <class X>
struct Sums {
    X one, other;
};
template <class X>
CATENARY_INLINE Sums<X> sums_from(const X& x) {
    return {x, X::all(-0.0)};  // neutral in sums, even for -0.0
}
template <class X>
CATENARY_INLINE Sums<X> no_sums() {
    return sums_from(X::all(0.0));
}

}  // namespace catenary::CATENARY_TARGET
