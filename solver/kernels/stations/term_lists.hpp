#pragma once
// Products with blocks whose terms are known at run time only.
#include <vector>

#include "stations/lanes.hpp"

namespace catenary::CATENARY_TARGET {

/// Terms by differences, as lists of numbers and of what they multiply, for N vectors.
template <int N, int Wide>
class TermLists {
  public:
    using X = Lanes<N, Wide>;
    int size = 0;  ///< numbers of a block

    TermLists() = default;
    TermLists(const Layout& layout, const Terms& terms) : size(terms.size) {
        const Pieces p = pieces_of(layout);
        for (int i = 0; i < p.n; ++i)
            for (int k = 0; k < terms.n; ++k) {
                const int begin = terms.begin[p.of_register[i]][k];
                if (begin < 0) continue;
                // A difference takes the lanes of one vector in another order. Lanes that a vector
                // lacks take none: their numbers are zero.
                int source = -1;
                for (int lane = 0; lane < p.size[i] && source < 0; ++lane) {
                    const int from = terms.source[k][p.first[i] + lane];
                    if (from < 0) continue;
                    int q = 0;
                    while (from >= p.first[q] + p.size[q]) ++q;
                    source = Wide * q + ((from - p.first[q]) ^ lane);
                }
                lists_[i][terms.sum[k]].push_back({static_cast<int16_t>(begin + p.offset[i]),
                                                   static_cast<int16_t>(source < 0 ? 0 : source)});
            }
        for (int i = 0; i < p.n; ++i) is_half_[i] = p.size[i] < Wide;
    }

    void add(Sums<X>& sums, const double* numbers, const X& x) const {
        Vector<Wide> exchanged[N * Wide];
        for (int i = 0; i < N; ++i)
            each<Wide>([&](auto d) CATENARY_HOT {
                exchanged[Wide * i + d] = [&]<int... I>(Numbers<I...>) CATENARY_HOT {
                    return __builtin_shufflevector(x.piece[i], x.piece[i], (I ^ d)...);
                }(Below<Wide>{});
            });
        for (int i = 0; i < N; ++i) {
            add_list(sums.one.piece[i], lists_[i][0], is_half_[i], numbers, exchanged);
            add_list(sums.other.piece[i], lists_[i][1], is_half_[i], numbers, exchanged);
        }
    }

  private:
    struct Term {
        int16_t number, source;
    };

    CATENARY_INLINE static void add_list(Vector<Wide>& sum, const std::vector<Term>& list,
                                         bool is_half, const double* numbers,
                                         const Vector<Wide>* exchanged) {
        Vector<Wide> total = sum;
        if (is_half)
            for (const Term& term : list)
                total += read<Wide, Wide / 2>(numbers + term.number) * exchanged[term.source];
        else
            for (const Term& term : list)
                total += read<Wide, Wide>(numbers + term.number) * exchanged[term.source];
        sum = total;
    }

    std::vector<Term> lists_[N][2];
    bool is_half_[N] = {};
};

}  // namespace catenary::CATENARY_TARGET
