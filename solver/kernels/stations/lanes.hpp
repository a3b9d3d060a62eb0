#pragma once
// The unknowns of a station in vectors of the processor. Included once for each target.
#ifndef CATENARY_TARGET
#error "include this from a target"
#endif
#include <type_traits>
#include <utility>

#include "stations/layout.hpp"

namespace catenary::CATENARY_TARGET {

#if defined(__AVX512F__)
constexpr int kNative = 8;
#else
constexpr int kNative = 4;
#endif
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

/// The vectors that hold the lanes of a layout: pieces of its registers.
struct Pieces {
    std::array<int8_t, kMostLanes / 2> first{}, size{}, of_register{}, offset{};
    int n = 0, wide = 0;  ///< how many, and the lanes of each, of which the last may be unused
};
constexpr Pieces pieces_of(const Layout& layout) {
    Pieces pieces;
    const Registers registers = registers_of(layout);
    int largest = 2, lane = 0;
    for (int r = 0; r < registers.n; ++r)
        largest = registers.size[r] > largest ? registers.size[r] : largest;
    pieces.wide = largest < kNative ? largest : kNative;
    for (int r = 0; r < registers.n; ++r)
        for (int at = 0; at < registers.size[r]; at += pieces.wide) {
            const int left = registers.size[r] - at;
            pieces.first[pieces.n] = static_cast<int8_t>(lane);
            pieces.size[pieces.n] = static_cast<int8_t>(left < pieces.wide ? left : pieces.wide);
            pieces.of_register[pieces.n] = static_cast<int8_t>(r);
            pieces.offset[pieces.n] = static_cast<int8_t>(at);
            lane += pieces.size[pieces.n++];
        }
    return pieces;
}

/// N vectors of so many lanes.
template <int N, int Wide>
struct Lanes {
    Vector<Wide> piece[N];

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
    return {x, X::all(-0.0)};  // what adds nothing, not even a sign
}
template <class X>
CATENARY_INLINE Sums<X> no_sums() {
    return sums_from(X::all(0.0));
}

}  // namespace catenary::CATENARY_TARGET
