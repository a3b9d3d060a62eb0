#pragma once
// Products with blocks of stations whose layout is known when the kernels are compiled.
#include <memory>

#include "stations/term_lists.hpp"

namespace catenary::CATENARY_TARGET {

/// Where a vector takes its numbers from; `Of::at` gives the lane of each, -1 for any.
template <Layout L, class Of>
struct Gathering {
    static constexpr Pieces p = pieces_of(L);
    struct Used {
        std::array<int, kMostLanes> piece{};
        int n = 0;
    };
    static constexpr int piece_of(int lane) {
        int q = 0;
        while (lane >= p.first[q] + p.size[q]) ++q;
        return q;
    }
    static constexpr Used find() {
        Used used;
        for (int k = 0; k < p.wide; ++k) {
            if (Of::at(k) < 0) continue;
            bool known = false;
            for (int i = 0; i < used.n; ++i) known = known || used.piece[i] == piece_of(Of::at(k));
            if (!known) used.piece[used.n++] = piece_of(Of::at(k));
        }
        return used;
    }
    static constexpr Used used = find();
    /// Lane in two pieces that follow each other, -1 if it is of none.
    static constexpr int of_two(int k, int first, int second) {
        if (Of::at(k) < 0) return -1;
        const int q = piece_of(Of::at(k)), lane = Of::at(k) - p.first[q];
        return q == first ? lane : q == second ? p.wide + lane : -1;
    }
    /// The same in vectors from the first two and from the last two pieces.
    static constexpr int of_pairs(int k) {
        if (Of::at(k) < 0) return -1;
        const int q = piece_of(Of::at(k));
        return q == used.piece[0] || q == used.piece[1] ? k : p.wide + k;
    }
    static constexpr bool as_it_is() {
        for (int k = 0; k < p.wide; ++k)
            if (Of::at(k) >= 0 && Of::at(k) - p.first[used.piece[0]] != k) return false;
        return used.n == 1;
    }
};

template <class G, int First, int Second, class V>
CATENARY_INLINE V from_two(V one, V other) {
    return [&]<int... I>(Numbers<I...>) CATENARY_HOT {
        return __builtin_shufflevector(one, other, G::of_two(I, First, Second)...);
    }(Below<G::p.wide>{});
}

template <Layout L, class Of, class X>
CATENARY_INLINE auto gathered(const X& x, Of) {
    using G = Gathering<L, Of>;
    using V = std::remove_cvref_t<decltype(x.piece[0])>;
    constexpr int n = G::used.n, a = G::used.piece[0], b = n > 1 ? G::used.piece[1] : a;
    static_assert(n <= 4);
    if constexpr (n == 0)
        return V{};
    else if constexpr (G::as_it_is())
        return x.piece[a];
    else if constexpr (n <= 2)
        return from_two<G, a, b>(x.piece[a], x.piece[b]);
    else {
        constexpr int c = G::used.piece[2], d = n > 3 ? G::used.piece[3] : c;
        const V one = from_two<G, a, b>(x.piece[a], x.piece[b]);
        const V other = from_two<G, c, d>(x.piece[c], x.piece[d]);
        return [&]<int... I>(Numbers<I...>) CATENARY_HOT {
            return __builtin_shufflevector(one, other, G::of_pairs(I)...);
        }(Below<G::p.wide>{});
    }
}

/// Whether half of a piece is unused, so that both sums have room in the first one's.
template <Layout L>
constexpr bool is_half(int piece) {
    constexpr Pieces p = pieces_of(L);
    return !L.turns() && 2 * p.size[piece] == p.wide;
}
/// Whether a term of such a piece is multiplied at once with the one after it.
template <Layout L, Terms T>
constexpr bool begins_pair(int term, int piece) {
    constexpr Pieces p = pieces_of(L);
    if (term < 0 || term % 2 || term + 1 >= T.n) return false;
    const auto& begin = T.begin[p.of_register[piece]];
    return begin[term] >= 0 && begin[term + 1] == begin[term] + p.size[piece];
}

/// Sources of a term in a piece; of two terms in the halves of one.
template <Layout L, Terms T, int Term, int Piece, bool Both>
struct Source {
    static constexpr int at(int k) {
        constexpr Pieces p = pieces_of(L);
        constexpr int size = p.size[Piece];
        if (Both) return T.source[Term + k / size][p.first[Piece] + k % size];
        return k < size ? T.source[Term][p.first[Piece] + k] : -1;
    }
};
template <Layout L, Halves H, int Term, int Piece>
struct Back {
    static constexpr int at(int k) {
        constexpr Pieces p = pieces_of(L);
        return k < p.size[Piece] ? H.back[Term][p.first[Piece] + k] : -1;
    }
};
template <Layout L, int First>
struct Exchanged {
    static constexpr int at(int k) { return First + k < L.n_lanes() ? (First + k) ^ 1 : -1; }
};

/// A number that is worked out when this is compiled.
template <int N>
constexpr int kSize = N;

/// Blocks of rows of the layout R and of factors of the layout F, which have the same lanes. Where
/// differences are known at run time only, they are multiplied by lists.
template <Layout R, Layout F>
struct KnownBlocks {
    static constexpr Pieces p = pieces_of(R);
    static constexpr int pitch = R.pitch(), whole_size = whole_terms(F).size;
    static constexpr bool is_sparse = F.sparse;
    using X = Lanes<p.n, p.wide>;
    using Lists = TermLists<p.n, p.wide>;

    explicit KnownBlocks(const Layout& rows, const Layout& factors) {
        if constexpr (R.by_lists) rows_ = std::make_unique<RowLists>(rows);
        if constexpr (F.by_lists) beside_ = std::make_unique<Lists>(factors, beside_terms(factors));
    }

    CATENARY_INLINE bool is_damped() const {
        if constexpr (R.by_lists)
            return rows_->is_damped;
        else
            return R.damped;
    }
    CATENARY_INLINE int own_size() const {
        if constexpr (R.by_lists)
            return rows_->own.size;
        else
            return kSize<own_terms(R).size>;
    }
    CATENARY_INLINE int row_beside_size() const {
        if constexpr (R.by_lists)
            return rows_->beside.size;
        else
            return kSize<beside_terms(R).size>;
    }
    CATENARY_INLINE int beside_size() const {
        if constexpr (F.by_lists)
            return beside_->size;
        else
            return kSize<beside_terms(F).size>;
    }

    CATENARY_INLINE static X load(const double* from) {
        X x;
        each<p.n>([&](auto i) CATENARY_HOT {
            x.piece[i] = read<p.wide, p.size[i]>(from + R.unknown(p.first[i]));
        });
        return x;
    }
    CATENARY_INLINE static void store(double* to, const X& x) {
        each<p.n>([&](auto i) CATENARY_HOT {
            write<p.wide, p.size[i]>(to + R.unknown(p.first[i]), x.piece[i]);
        });
    }
    CATENARY_INLINE static X total_of(const Sums<X>& sums) {
        X x;
        each<p.n>([&](auto i) CATENARY_HOT {
            auto one = sums.one.piece[i];
            if constexpr (is_half<R>(i) && (R.by_lists || F.by_lists)) one += sums.other.piece[i];
            if constexpr (is_half<R>(i))
                x.piece[i] = one + [&]<int... I>(Numbers<I...>) CATENARY_HOT {
                    return __builtin_shufflevector(one, one, ((I + p.size[i]) % p.wide)...);
                }(Below<p.wide>{});
            else if constexpr (R.turns())
                x.piece[i] = one + gathered<R>(sums.other, Exchanged<R, p.first[i]>{});
            else
                x.piece[i] = one + sums.other.piece[i];
        });
        return x;
    }

    CATENARY_INLINE void add_own(Sums<X>& sums, const double* numbers, const X& x) const {
        if constexpr (R.by_lists)
            rows_->own.add(sums, numbers, x);
        else
            add<own_terms(R)>(sums, numbers, x);
    }
    CATENARY_INLINE void add_row_beside(Sums<X>& sums, const double* numbers, const X& x) const {
        if constexpr (R.by_lists)
            rows_->beside.add(sums, numbers, x);
        else
            add<beside_terms(R)>(sums, numbers, x);
    }
    CATENARY_INLINE void add_beside(Sums<X>& sums, const double* numbers, const X& x) const {
        if constexpr (F.by_lists)
            beside_->add(sums, numbers, x);
        else
            add<beside_terms(F)>(sums, numbers, x);
    }
    CATENARY_INLINE static void add_whole(Sums<X>& sums, const double* numbers, const X& x) {
        add<whole_terms(F)>(sums, numbers, x);
    }
    /// S^-1 times x: of a symmetric block one half is stored if factors are sparse.
    CATENARY_INLINE static void add_inverse(Sums<X>& sums, const double* numbers, const X& x) {
        if constexpr (!F.sparse)
            add_whole(sums, numbers, x);
        else {
            constexpr Halves halves = halves_of(F);
            add<halves.terms>(sums, numbers, x);
            each<halves.terms.n>([&](auto k) CATENARY_HOT {
                if constexpr (halves.mirrored[k]) add_mirrored<halves, k>(sums, numbers, x);
            });
        }
    }

  private:
    struct RowLists {
        bool is_damped;
        Lists own, beside;
        explicit RowLists(const Layout& rows)
            : is_damped(rows.damped),
              own(rows, own_terms(rows)),
              beside(rows, beside_terms(rows)) {}
    };

    /// Add a block times x.
    template <Terms T>
    CATENARY_INLINE static void add(Sums<X>& sums, const double* numbers, const X& x) {
        each<T.n>([&](auto k) CATENARY_HOT {
            each<p.n>([&](auto i) CATENARY_HOT {
                constexpr int begin = T.begin[p.of_register[i]][k];
                if constexpr (begin < 0)
                    return;
                else if constexpr (is_half<R>(i) && begins_pair<R, T>(k, i))
                    sums.one.piece[i] += read<p.wide, p.wide>(numbers + begin) *
                                         gathered<R>(x, Source<R, T, k, i, true>{});
                else if constexpr (is_half<R>(i) && begins_pair<R, T>(k - 1, i))
                    return;
                else {
                    const auto product = read<p.wide, p.size[i]>(numbers + begin + p.offset[i]) *
                                         gathered<R>(x, Source<R, T, k, i, false>{});
                    if constexpr (T.sum[k] && !is_half<R>(i))
                        sums.other.piece[i] += product;
                    else
                        sums.one.piece[i] += product;
                }
            });
        });
    }
    /// Add what the half that is not stored makes of x in one term.
    template <Halves H, int Term>
    CATENARY_INLINE static void add_mirrored(Sums<X>& sums, const double* numbers, const X& x) {
        X product = X::all(0.0);
        each<p.n>([&](auto i) CATENARY_HOT {
            constexpr int begin = H.terms.begin[p.of_register[i]][Term];
            if constexpr (begin >= 0)
                product.piece[i] =
                    read<p.wide, p.size[i]>(numbers + begin + p.offset[i]) * x.piece[i];
        });
        each<p.n>([&](auto i) CATENARY_HOT {
            const auto back = gathered<R>(product, Back<R, H, Term, i>{});
            if constexpr (is_half<R>(i))
                // The other half holds a sum, to which this adds nothing.
                sums.one.piece[i] += [&]<int... I>(Numbers<I...>) CATENARY_HOT {
                    return __builtin_shufflevector(back, decltype(back){},
                                                   (I < p.size[i] ? I : p.wide)...);
                }(Below<p.wide>{});
            else
                sums.one.piece[i] += back;
        });
    }

    std::unique_ptr<RowLists> rows_;
    std::unique_ptr<Lists> beside_;
};

}  // namespace catenary::CATENARY_TARGET
