#pragma once
// Products of packed blocks with the unknowns of a station in several scenes, which share matrices
// and factors. Unknown u of scene s stands at u L + s: a lane is a scene, and a number of a block
// is multiplied with all of them.
#include "stations/passes.hpp"

namespace catenary::CATENARY_TARGET {

/// A number of a packed block: the unknowns that it joins, and where it stands.
struct Numbered {
    Joint joint;
    int at = 0;
    bool is_off_diagonal = false;
};
/// Numbers of a packed block of N, column by column, so that an unknown is read once.
template <int N>
struct Joints {
    std::array<Numbered, N> of{};
    int n = 0;
};
template <int N>
constexpr Joints<N> joints_of(const Pieces& pieces, const Mask& mask) {
    Joints<N> found;
    for (int column = 0; column < pieces.unknowns; ++column) {
        int at = 0;
        each_number(pieces, mask, [&](const Joint& joint, int i, int j, int) {
            if (joint.row >= 0 && joint.column == column) found.of[found.n++] = {joint, at, i != j};
            ++at;
        });
    }
    return found;
}

/// Blocks of one of the shipped lines, for L scenes.
template <int K, int L>
struct SceneBlocks : KnownMasks<K> {
    using Of = KnownMasks<K>;
    static constexpr int W = Of::r.unknowns, pitch = W * L;
    static constexpr bool kNarrow = false, kHasEven = W % 2 == 0 && !Of::is_damped;
    using V = Vector<L>;
    using X = Lanes<W, L>;

    using Of::Of;

    CATENARY_INLINE static X load(const double* from) {
        X x;
        each<W>([&](auto u) CATENARY_HOT { x.piece[u] = read<L, L>(from + L * u); });
        return x;
    }
    CATENARY_INLINE static X load_once(const double* from) { return load(from); }
    CATENARY_INLINE static void store(double* to, const X& x) {
        each<W>([&](auto u) CATENARY_HOT { write<L, L>(to + L * u, x.piece[u]); });
    }
    CATENARY_INLINE static X total_of(const Sums<X>& sums) { return sums.one; }

    /// Whether rows join pairs of unknowns, deflection and rotation, each only with itself here and
    /// beside, even about the station: those of nodes between equal elements without droppers.
    static bool is_even(const double* numbers) {
        const double *to_start = numbers + Of::own_size, *to_end = to_start + Of::row_beside_size;
        for (const Numbered& own : kOwn.of)
            if (own.joint.row != own.joint.column && numbers[own.at] != 0.0) return false;
        for (const auto& [joint, at, _] : kRowBeside.of) {
            const double sign = joint.row == joint.column ? 1.0 : -1.0;
            if (to_start[at] != sign * to_end[at]) return false;
            if (joint.row / 2 != joint.column / 2 && to_end[at] != 0.0) return false;
        }
        return true;
    }
    /// Add such rows, `ahead` with the station after: half as many products, and sums that
    /// processors make beside them.
    CATENARY_INLINE static void add_even(Sums<X>& sums, const double* own, const double* ahead,
                                         const X& before, const X& here, const X& after) {
        each<W / 2>([&](auto pair) CATENARY_HOT {
            constexpr int w = 2 * pair, r = w + 1;
            const V level = before.piece[w] + after.piece[w],
                    rise = after.piece[w] - before.piece[w],
                    turned = before.piece[r] + after.piece[r],
                    bend = after.piece[r] - before.piece[r];
            sums.one.piece[w] += own[at<kOwn, w, w>] * here.piece[w] +
                                 ahead[at<kRowBeside, w, w>] * level +
                                 ahead[at<kRowBeside, w, r>] * bend;
            sums.one.piece[r] += own[at<kOwn, r, r>] * here.piece[r] +
                                 ahead[at<kRowBeside, r, w>] * rise +
                                 ahead[at<kRowBeside, r, r>] * turned;
        });
    }

    CATENARY_INLINE static void add_own(Sums<X>& sums, const double* numbers, const X& x) {
        add<kOwn>(sums, numbers, x);
    }
    CATENARY_INLINE static void add_row_beside(Sums<X>& sums, const double* numbers, const X& x) {
        add<kRowBeside>(sums, numbers, x);
    }
    CATENARY_INLINE static void add_beside(Sums<X>& sums, const double* numbers, const X& x) {
        add<kBeside>(sums, numbers, x);
    }
    CATENARY_INLINE static void add_whole(Sums<X>& sums, const double* numbers, const X& x) {
        add<kWhole>(sums, numbers, x);
    }
    CATENARY_INLINE static void add_inverse(Sums<X>& sums, const double* numbers, const X& x) {
        add<kHalf, true>(sums, numbers, x);
    }

  private:
    static constexpr Pieces kPieces{W};
    template <int N>
    static constexpr auto of(const Mask& mask) {
        return joints_of<N>(kPieces, mask);
    }
    static constexpr Mask kHalfMask = upper(Of::whole);
    static constexpr auto kOwn = of<Of::own_size>(Of::row_own);
    static constexpr auto kRowBeside = of<Of::row_beside_size>(Of::row_beside);
    static constexpr auto kWhole = of<Of::f.size_of(Of::whole)>(Of::whole);
    static constexpr auto kBeside = of<Of::beside_size>(Of::beside);
    static constexpr auto kHalf = of<Of::half_size>(kHalfMask);

    /// Where the number stands that joins a row with a column.
    template <const auto& List, int Row, int Column>
    static constexpr int at = [] {
        for (const Numbered& one : List.of)
            if (one.joint.row == Row && one.joint.column == Column) return one.at;
        return -1;
    }();
    template <const auto& List, bool IsSymmetric = false>
    CATENARY_INLINE static void add(Sums<X>& sums, const double* numbers, const X& x) {
        each<List.n>([&](auto p) CATENARY_HOT {
            constexpr Numbered own = List.of[p];
            const V number = numbers[own.at] - V{};
            sums.one.piece[own.joint.row] += number * x.piece[own.joint.column];
            if constexpr (IsSymmetric && own.is_off_diagonal)
                sums.one.piece[own.joint.column] += number * x.piece[own.joint.row];
        });
    }
};

/// Kernels of L scenes that were compiled for rows and factors, or null.
template <int L, int K = 0>
std::unique_ptr<Kernels> make_for_scenes(const Layout& rows, const Layout& factors) {
    if constexpr (K < std::size(kShipped)) {
        constexpr Shipped s = kShipped[K];
        if constexpr (is_checked(s) && s.rows.unknowns * L <= kMostNumbers && s.is_for_scenes)
            if (rows == s.rows && factors == s.factors)
                return std::make_unique<KernelsOf<SceneBlocks<K, L>, true>>(rows, factors);
        return make_for_scenes<L, K + 1>(rows, factors);
    }
    return nullptr;
}

std::unique_ptr<Kernels> make_for_scenes(const Layout& rows, const Layout& factors, int scenes) {
    if (scenes == kScenes) return make_for_scenes<kScenes>(rows, factors);
#if defined(CATENARY_TARGET_HAS_AVX512)
    if (scenes == kMostScenes) return make_for_scenes<kMostScenes>(rows, factors);
#endif
    return nullptr;
}

}  // namespace catenary::CATENARY_TARGET
