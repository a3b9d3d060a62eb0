#pragma once
// The unknowns of a station in vectors of the processor, and products of packed blocks with them;
// see layout.hpp. Included once for each target.
#ifndef CATENARY_TARGET
#error "include this from a target"
#endif
#include <type_traits>
#include <utility>

#include "stations/known_layouts.hpp"

// A pragma that names AVX does not define its macro: C++ is read whole before pragmas take effect.
#undef CATENARY_HAS_AVX
#if defined(CATENARY_TARGET_HAS_AVX) || defined(__AVX__)
#define CATENARY_HAS_AVX 1
#else
#define CATENARY_HAS_AVX 0
#endif

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

/// Masks of rows and factors and the numbers of their blocks, of one of the shipped lines.
template <int K>
struct KnownMasks {
    static constexpr bool is_known = true;
    static constexpr Layout r = kShipped[K].rows, f = kShipped[K].factors;
    static constexpr int pitch = r.unknowns;
    static constexpr bool is_damped = r.is_damped, is_sparse = f.is_sparse();
    static constexpr Mask row_own = r.own, row_beside = r.beside, whole = f.own, beside = f.beside;
    static constexpr int own_size = r.size_of(row_own), row_beside_size = r.size_of(row_beside),
                         half_size = f.size_of(upper(whole)), beside_size = f.size_of(beside);

    KnownMasks(const Layout&, const Layout&) {}
};

/// The same found at run time. Kernels test which products each square has: a processor predicts
/// the branch, as it is the same for the station before.
struct GivenMasks {
    static constexpr bool is_known = false;
    int pitch;
    bool is_damped, is_sparse;
    Mask row_own, row_beside, whole, beside;
    int own_size, row_beside_size, half_size, beside_size;

    GivenMasks(const Layout& r, const Layout& f)
        : pitch(r.unknowns),
          is_damped(r.is_damped),
          is_sparse(f.is_sparse()),
          row_own(r.own),
          row_beside(r.beside),
          whole(f.own),
          beside(f.beside),
          own_size(r.size_of(row_own)),
          row_beside_size(r.size_of(row_beside)),
          half_size(f.size_of(upper(whole))),
          beside_size(f.size_of(beside)) {}
};

// Vectors up to which a kernel that finds masks at run time adds each block in its place. Where
// processors differ much, the oldest has no such code: compiling it took a sixth of all the time.
// Nor have builds that check each access.
#if defined(CATENARY_GENERAL_ONLY) || defined(CATENARY_CHECKS)
constexpr int kInPlace = 1;
#else
constexpr int kInPlace = 3;
#endif

/// Blocks of stations that take W lanes.
template <int W, class Masks>
struct Blocks : Masks {
    static constexpr Pieces kPieces{W};
    static constexpr int kN = kPieces.n(), kVector = kPieces.vector();
    static constexpr int kInLast = W - (kN - 1) * kVector;
    static constexpr bool kHalf = kInLast < kVector;
    /// Whether a chain waits for its products, and not the processor for their numbers.
    static constexpr bool kNarrow = kN == 1;
    static constexpr bool kHasEven = false;
    using V = Vector<kVector>;
    using X = Lanes<kN, kVector>;

    using Masks::Masks;

    /// Unknowns from a place on; a piece of two is in both halves of its vector.
    CATENARY_INLINE X load(const double* from) const {
        X x = load_once(from);
        if constexpr (kHalf)
            x.piece[kN - 1] = this->pitch == W ? twice(from + kVector * (kN - 1))
                                               : x.piece[kN - 1] + crossed(x.piece[kN - 1]);
        return x;
    }
    /// The same with zeros behind a piece of two, as a sum begins.
    CATENARY_INLINE X load_once(const double* from) const {
        X x;
        each<kN - 1>([&](auto i)
                         CATENARY_HOT { x.piece[i] = read<kVector, kVector>(from + kVector * i); });
        const double* const last = from + kVector * (kN - 1);
        if (this->pitch == W) {
            x.piece[kN - 1] = read<kVector, kInLast>(last);
        } else {
            x.piece[kN - 1] = V{};
            for (int k = 0; k < this->pitch - kVector * (kN - 1); ++k) x.piece[kN - 1][k] = last[k];
        }
        return x;
    }
    CATENARY_INLINE void store(double* to, const X& x) const {
        each<kN - 1>([&](auto i)
                         CATENARY_HOT { write<kVector, kVector>(to + kVector * i, x.piece[i]); });
        double* const last = to + kVector * (kN - 1);
        if (this->pitch == W)
            write<kVector, kInLast>(last, x.piece[kN - 1]);
        else
            for (int k = 0; k < this->pitch - kVector * (kN - 1); ++k) last[k] = x.piece[kN - 1][k];
    }
    CATENARY_INLINE static X total_of(const Sums<X>& sums) {
        X x;
        each<kN>([&](auto i) CATENARY_HOT {
            x.piece[i] = sums.one.piece[i] + turned(sums.other.piece[i]);
        });
        if constexpr (kHalf) x.piece[kN - 1] += crossed(x.piece[kN - 1]);
        return x;
    }

    CATENARY_INLINE void add_own(Sums<X>& sums, const double* numbers, const X& x) const {
        add(sums, numbers, this->row_own, x);
    }
    CATENARY_INLINE void add_row_beside(Sums<X>& sums, const double* numbers, const X& x) const {
        add(sums, numbers, this->row_beside, x);
    }
    CATENARY_INLINE void add_beside(Sums<X>& sums, const double* numbers, const X& x) const {
        add(sums, numbers, this->beside, x);
    }
    CATENARY_INLINE void add_whole(Sums<X>& sums, const double* numbers, const X& x) const {
        add(sums, numbers, this->whole, x);
    }
    /// The transpose of a block that joins all of a plane, times x. Of one vector only.
    CATENARY_INLINE void add_transposed(Sums<X>& sums, const double* numbers, const X& x) const {
        const V here = x.piece[0];
        V &one = sums.one.piece[0], &other = sums.other.piece[0];
        with_kinds<0, 0>(this->whole[0][0], [&](int there) CATENARY_HOT {
            if (there & 1) one += next(numbers) * here;
            if (there & 2) other += turned(next(numbers)) * here;
            if constexpr (has_crossed(0, 0)) {
                if (there & 4) one += crossed(next(numbers)) * crossed(here);
                if (there & 8) other += turned(crossed(next(numbers))) * crossed(here);
            }
        });
    }
    /// S^-1 times x: of this symmetric block each square above the diagonal counts for two.
    CATENARY_INLINE void add_inverse(Sums<X>& sums, const double* numbers, const X& x) const {
        if constexpr (Masks::is_known || kN <= kInPlace)
            add_symmetric_here(sums, numbers, this->whole, x);
        else
            add_symmetric_apart(sums, numbers, this->whole, x);
    }

  private:
    CATENARY_INLINE static V turned(V x) {
        return [&]<int... I>(Numbers<I...>) CATENARY_HOT {
            return __builtin_shufflevector(x, x, (I ^ 1)...);
        }(Below<kVector>{});
    }
    CATENARY_INLINE static V crossed(V x) {
        V y = x;
#if CATENARY_HAS_AVX
        // GCC takes vpermpd, which takes AMD's processors twice as long: a chain waits for it.
        if constexpr (kVector == 4) asm("vperm2f128 $1, %1, %1, %0" : "=x"(y) : "x"(x));
#else
        if constexpr (kVector == 4) y = __builtin_shufflevector(x, x, 2, 3, 0, 1);
#endif
        return y;
    }
    CATENARY_INLINE static V twice(const double* two) {
#if CATENARY_HAS_AVX
        return __builtin_ia32_vbroadcastf128_pd256(reinterpret_cast<const Vector<2>*>(two));
#else
        const auto found = read<2, 2>(two);
        return __builtin_shufflevector(found, found, 0, 1, 0, 1);
#endif
    }
    /// Numbers of the next product; a product of two unknowns is padded with zeros.
    CATENARY_INLINE static V next(const double*& numbers) {
        const V found = read<kVector, kVector>(numbers);
        numbers += kVector;
        return found;
    }

    /// Add a block times x. Kernels of wide stations that find masks at run time do so in one place
    /// for all of their blocks: their code is long.
    CATENARY_INLINE static void add(Sums<X>& sums, const double* numbers, const Mask& mask,
                                    const X& x) {
        if constexpr (Masks::is_known || kN <= kInPlace)
            add_here(sums, numbers, mask, x);
        else
            add_apart(sums, numbers, mask, x);
    }
    __attribute__((noinline)) static void add_apart(Sums<X>& sums, const double* numbers,
                                                    const Mask& mask, const X& x) {
        add_here(sums, numbers, mask, x);
    }
    CATENARY_INLINE static void add_here(Sums<X>& sums, const double* numbers, const Mask& mask,
                                         const X& x) {
        each<kN>([&](auto i) CATENARY_HOT {
            each<kN>([&](auto j) CATENARY_HOT { add_square<i, j>(sums, numbers, mask[i][j], x); });
        });
    }
    template <int I, int J>
    CATENARY_INLINE static void add_square(Sums<X>& sums, const double*& numbers, int kinds,
                                           const X& x) {
        V &one = sums.one.piece[I], &other = sums.other.piece[I];
        with_kinds<I, J>(kinds, [&](int there) CATENARY_HOT {
            if (there & 1) one += next(numbers) * x.piece[J];
            if (there & 2) other += next(numbers) * x.piece[J];
            if constexpr (has_crossed(I, J)) {
                if (there & 4) one += next(numbers) * crossed(x.piece[J]);
                if (there & 8) other += next(numbers) * crossed(x.piece[J]);
            }
        });
    }
    /// Call a function with the kinds of products of a square. If masks are found at run time it
    /// is compiled twice: a square that has all of them, as most have, needs no further test.
    template <int I, int J, class F>
    CATENARY_INLINE static void with_kinds(int kinds, F&& function) {
        constexpr int all = all_kinds(kPieces, I, J);
        if constexpr (!Masks::is_known) {
            if (kinds == all) return function(all);
            if (!kinds) return;
        }
        function(kinds);
    }
    __attribute__((noinline)) static void add_symmetric_apart(Sums<X>& sums, const double* numbers,
                                                              const Mask& mask, const X& x) {
        add_symmetric_here(sums, numbers, mask, x);
    }
    CATENARY_INLINE static void add_symmetric_here(Sums<X>& sums, const double* numbers,
                                                   const Mask& mask, const X& x) {
        X crossing = X::all(0.0);  // products of kinds 2 and 3 with the transpose
        each<kN>([&](auto i) CATENARY_HOT {
            const V turned_here = turned(x.piece[i]);
            add_square<i, i>(sums, numbers, mask[i][i], x);
            each<kN - 1 - i>([&](auto further) CATENARY_HOT {
                constexpr int j = i + 1 + further;
                const double* again = numbers;
                add_square<i, j>(sums, numbers, mask[i][j], x);
                V& straight = sums.one.piece[j];
                with_kinds<i, j>(mask[i][j], [&](int there) CATENARY_HOT {
                    if (there & 1) straight += next(again) * x.piece[i];
                    if (there & 2) straight += next(again) * turned_here;
                    if constexpr (has_crossed(i, j)) {
                        if (there & 4) crossing.piece[j] += next(again) * x.piece[i];
                        if (there & 8) crossing.piece[j] += next(again) * turned_here;
                    }
                });
            });
        });
        each<kN>([&](auto j) CATENARY_HOT {
            if constexpr (j > 0 && has_crossed(0, j))
                sums.one.piece[j] += crossed(crossing.piece[j]);
        });
    }
    static constexpr bool has_crossed(int i, int j) { return all_kinds(kPieces, i, j) > 3; }
};

}  // namespace catenary::CATENARY_TARGET
