#pragma once
// How the unknowns of a station stand in vectors, and which products a block of a matrix needs.
//
// Unknowns follow each other in pieces, vectors of four lanes; the last one may have two. A block
// of a matrix is a grid of squares, each of the rows of one piece and the columns of another, and a
// square is the sum of four products, lane by lane, of its numbers with
//
//     kind   lanes of x                   lanes of the sum
//     0      as they are                  as they are
//     1      as they are                  0 and 1, 2 and 3 exchanged
//     2      pairs 0,1 and 2,3 exchanged  as they are
//     3      pairs 0,1 and 2,3 exchanged  0 and 1, 2 and 3 exchanged
//
// So x is exchanged once for all rows, and sums once when all columns are added. Where the columns
// are a piece of two, x holds them twice; where the rows are, both halves of the sum are added up
// in the end: of both, kinds 0 and 1 are enough. The mask of a block lists its products: the
// others are neither stored nor multiplied.
#include <array>
#include <bit>
#include <cstdint>

#include "base/targets.hpp"

namespace catenary {

constexpr int kMostUnknowns = 32, kMostPieces = 8, kKinds = 4;
/// Numbers of a station in all scenes that stand side by side.
constexpr int kMostNumbers = 64;

/// Kinds of products of each square, a bit for each.
using Mask = std::array<std::array<uint8_t, kMostPieces>, kMostPieces>;

/// Vectors that hold so many unknowns.
struct Pieces {
    int unknowns = 0;

    /// Lanes of kernels that take them: all even numbers, and multiples of four of wide stations.
    constexpr int lanes() const { return unknowns <= 16 ? (unknowns + 1) / 2 * 2 : 4 * n(); }
    constexpr int vector() const { return unknowns <= 2 ? 2 : 4; }
    constexpr int n() const { return (unknowns + vector() - 1) / vector(); }
    constexpr bool is_half(int piece) const { return lanes() - piece * vector() < vector(); }
};

/// Kinds of products that the square of two pieces may have.
constexpr int all_kinds(const Pieces& pieces, int i, int j) {
    return pieces.vector() == 2 || pieces.is_half(i) || pieces.is_half(j) ? 3 : 15;
}

/// Row and column that a lane of a product's numbers joins; -1 if there are none.
struct Joint {
    int row = -1, column = -1;
};
constexpr Joint joint_of(const Pieces& pieces, int i, int j, int kind, int lane) {
    const int v = pieces.vector(), turned = lane ^ (kind & 1), crossed = lane ^ (kind & 2);
    const bool few_rows = pieces.is_half(i), few_columns = pieces.is_half(j);
    if (!(all_kinds(pieces, i, j) >> kind & 1)) return {};
    if (few_rows && few_columns && lane >= 2) return {};
    const Joint found{v * i + (few_rows ? turned % 2 : turned),
                      v * j + (few_columns ? lane % 2 : crossed)};
    return found.row < pieces.unknowns && found.column < pieces.unknowns ? found : Joint{};
}

/// Call `function(joint, i, j, kind)` for each number of a packed block, in their order.
template <class Function>
constexpr void each_number(const Pieces& pieces, const Mask& mask, const Function& function) {
    for (int i = 0; i < pieces.n(); ++i)
        for (int j = 0; j < pieces.n(); ++j)
            for (int kind = 0; kind < kKinds; ++kind)
                for (int lane = 0; mask[i][j] >> kind & 1 && lane < pieces.vector(); ++lane)
                    function(joint_of(pieces, i, j, kind, lane), i, j, kind);
}

/// The mask of a block that joins each row and column for which `joins(row, column)` is true.
template <class Joins>
constexpr Mask mask_of(const Pieces& pieces, const Joins& joins) {
    Mask mask{}, all;
    for (auto& row : all) row.fill(15);
    each_number(pieces, all, [&](const Joint& at, int i, int j, int kind) {
        if (at.row >= 0 && joins(at.row, at.column)) mask[i][j] |= 1 << kind;
    });
    return mask;
}

/// The same with all kinds in every square that has some.
constexpr Mask in_squares(const Pieces& pieces, Mask mask) {
    for (int i = 0; i < pieces.n(); ++i)
        for (int j = 0; j < pieces.n(); ++j)
            if (mask[i][j]) mask[i][j] = static_cast<uint8_t>(all_kinds(pieces, i, j));
    return mask;
}

/// Mask of the upper half of a symmetric block, whose numbers kernels read for both halves.
constexpr Mask upper(const Mask& mask) {
    Mask half = mask;
    for (int i = 0; i < kMostPieces; ++i)
        for (int j = 0; j < i; ++j) half[i][j] = 0;
    return half;
}

/// How many products a mask has, and whether all of another's are among them.
constexpr int n_products(const Mask& mask) {
    int n = 0;
    for (const auto& row : mask)
        for (const uint8_t kinds : row) n += std::popcount(kinds);
    return n;
}
constexpr bool holds(const Mask& mask, const Mask& other) {
    for (int i = 0; i < kMostPieces; ++i)
        for (int j = 0; j < kMostPieces; ++j)
            if (other[i][j] & ~mask[i][j]) return false;
    return true;
}

/// Sparsity of a station's blocks of rows, or of factors. See `station_products.py`.
struct Layout {
    int unknowns = 0;
    Mask own{};               ///< of a row's diagonal block; of factors S^-1 and -B^T S^-1
    Mask beside{};            ///< of the matrix's blocks between stations
    bool is_damped = false;   ///< whether rows hold -C as well as K
    bool is_factors = false;  ///< whether of factors, which keep half of S^-1

    constexpr bool operator==(const Layout&) const = default;

    constexpr Pieces pieces() const { return {unknowns}; }
    /// Whether the pass forth reads less if it multiplies with S^-1 and the matrix's own B than
    /// with -B^T S^-1. Factors keep -B^T S^-1 only in the other case.
    constexpr bool is_sparse() const {
        return is_factors && n_products(upper(own)) + n_products(beside) <= n_products(own);
    }
    /// Numbers of a packed block.
    constexpr int size_of(const Mask& mask) const { return n_products(mask) * pieces().vector(); }
    constexpr bool holds(const Layout& other) const {
        return unknowns == other.unknowns && is_damped == other.is_damped &&
               is_factors == other.is_factors && catenary::holds(own, other.own) &&
               catenary::holds(beside, other.beside);
    }
    /// Products that a row of such blocks makes.
    constexpr int of_row() const { return n_products(own) + 2 * n_products(beside); }
};

}  // namespace catenary
