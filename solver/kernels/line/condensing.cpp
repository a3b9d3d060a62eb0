// Bands of complex numbers factored row by row.
#include "line/condensing.hpp"

#include <algorithm>
#include <vector>

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

}  // namespace catenary
