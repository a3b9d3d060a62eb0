#pragma once
// Products with blocks of stations of any layout, found at run time.
#include "stations/term_lists.hpp"

namespace catenary::CATENARY_TARGET {

/// The same as `KnownBlocks` for N vectors of four lanes, which terms by differences exchange.
template <int N>
struct GeneralBlocks {
    using X = Lanes<N, 4>;
    struct Part {
        int unknown, size;
    };

    TermLists<N, 4> own, row_beside, beside, whole;
    std::array<Part, N> parts{};
    int pitch, whole_size;
    bool is_damped_, is_sparse;

    explicit GeneralBlocks(const Layout& rows, const Layout& factors)
        : own(rows, own_terms(rows)),
          row_beside(rows, beside_terms(rows)),
          beside(factors, beside_terms(factors)),
          whole(factors, whole_terms(factors)),
          pitch(rows.pitch()),
          whole_size(whole.size),
          is_damped_(rows.damped),
          is_sparse(factors.sparse) {
        for (int i = 0; i < rows.n_lanes() / 4; ++i) {
            parts[i] = {rows.unknown(4 * i), 0};
            while (parts[i].size < 4 && rows.unknown(4 * i + parts[i].size) >= 0) ++parts[i].size;
        }
    }
    bool is_damped() const { return is_damped_; }
    int own_size() const { return own.size; }
    int row_beside_size() const { return row_beside.size; }
    int beside_size() const { return beside.size; }

    CATENARY_INLINE X load(const double* from) const {
        X x;
        for (int i = 0; i < N; ++i) {
            const double* at = from + parts[i].unknown;
            if (parts[i].size == 4)
                x.piece[i] = read<4, 4>(at);
            else {
                x.piece[i] = Vector<4>{};
                for (int k = 0; k < parts[i].size; ++k) x.piece[i][k] = at[k];
            }
        }
        return x;
    }
    CATENARY_INLINE void store(double* to, const X& x) const {
        for (int i = 0; i < N; ++i) {
            double* at = to + parts[i].unknown;
            if (parts[i].size == 4)
                write<4, 4>(at, x.piece[i]);
            else
                for (int k = 0; k < parts[i].size; ++k) at[k] = x.piece[i][k];
        }
    }
    CATENARY_INLINE static X total_of(const Sums<X>& sums) {
        X x = sums.one;
        x += sums.other;
        return x;
    }

    CATENARY_INLINE void add_own(Sums<X>& sums, const double* numbers, const X& x) const {
        own.add(sums, numbers, x);
    }
    CATENARY_INLINE void add_row_beside(Sums<X>& sums, const double* numbers, const X& x) const {
        row_beside.add(sums, numbers, x);
    }
    CATENARY_INLINE void add_beside(Sums<X>& sums, const double* numbers, const X& x) const {
        beside.add(sums, numbers, x);
    }
    CATENARY_INLINE void add_whole(Sums<X>& sums, const double* numbers, const X& x) const {
        whole.add(sums, numbers, x);
    }
    CATENARY_INLINE void add_inverse(Sums<X>& sums, const double* numbers, const X& x) const {
        whole.add(sums, numbers, x);
    }
};

}  // namespace catenary::CATENARY_TARGET
