#pragma once
// Layouts that kernels are compiled for: those of the shipped kinds of lines.
#include <initializer_list>

#include "stations/layout.hpp"

namespace catenary {

constexpr uint32_t bits(std::initializer_list<int> differences) {
    uint32_t found = 0;
    for (int d : differences) found |= 1u << d;
    return found;
}
constexpr Layout rows_of(std::initializer_list<int> widths, std::initializer_list<int> own,
                         bool damped = false, std::initializer_list<int> beside = {0, 1}) {
    Layout layout;
    int n = 0;
    for (int width : widths) layout.widths[n++] = static_cast<int8_t>(width);
    layout.own = bits(own);
    layout.beside = bits(beside);
    layout.damped = damped;
    return layout;
}

/// Factors of rows that join all of a plane.
constexpr Layout dense_factors(const Layout& rows) {
    Layout layout;
    layout.widths = rows.widths;
    layout.general = rows.general;
    layout.own = layout.beside = (1u << layout.largest()) - 1;
    return layout;
}
/// Factors that keep the matrix's own blocks between stations.
constexpr Layout sparse_factors(const Layout& rows) {
    Layout layout;
    layout.widths = rows.widths;
    layout.general = rows.general;
    layout.own = 1;
    layout.beside = rows.beside | 3;
    layout.sparse = true;
    return layout;
}
constexpr Layout listed_factors(const Layout& rows) {
    Layout layout = sparse_factors(rows);
    layout.by_lists = true;
    return layout;
}

/// Rows of some widths, whatever they join.
constexpr Layout listed_rows(const Widths& widths) {
    Layout layout;
    layout.widths = widths;
    layout.by_lists = true;
    return layout;
}

/// Widths that kernels are compiled for.
constexpr Widths kWidths[] = {{2}, {2, 2}, {4}, {4, 4}, {6}, {8}, {10}, {12}, {16}};

/// Rows and factors of the shipped kinds of lines.
struct Shipped {
    Layout rows, factors;
    /// Whether such stations stand in one line with others, so that chains often go one by one.
    bool is_mixed = false;
};
constexpr Shipped dense(const Layout& rows) {
    return {rows, dense_factors(rows)};
}
constexpr Shipped sparse(const Layout& rows) {
    return {rows, sparse_factors(rows)};
}
constexpr Shipped mixed(Shipped shipped) {
    shipped.is_mixed = true;
    return shipped;
}
/// Two wires that stretch, in three planes, and the factors of each wire by itself.
constexpr Shipped kTensioned = [] {
    Shipped of = sparse(rows_of({10}, {0, 1, 2, 3, 4, 5, 6, 7, 8, 10, 11, 12, 13, 14}, true,
                                {0, 1, 2, 3, 4, 5, 6, 7, 10, 11, 12, 13}));
    of.factors.strands[0] = {1, 2, 5, 7, 8};
    of.factors.strands[1] = {3, 4, 6, 9, 10};
    return of;
}();
/// The same by M, and two wires that stretch in their plane.
constexpr Shipped kThreePlanes = {rows_of({10}, {0, 1}), kTensioned.factors};
constexpr Shipped kStretching = [] {
    Shipped of = sparse(rows_of({6}, {0, 1}));
    of.factors.beside = bits({0, 1, 4, 5, 6, 7});
    return of;
}();
constexpr Shipped kShipped[] = {
    dense(rows_of({2}, {0, 1})),                  // one wire
    dense(rows_of({2, 2}, {0, 1})),               // in two planes
    mixed(dense(rows_of({4}, {0, 1, 2}))),        // two wires with droppers
    sparse(rows_of({4}, {0, 1, 2})),              // the same where no two spans are alike
    mixed(dense(rows_of({4, 4}, {0, 1, 2}))),     // two such lines side by side, in an overlap
    sparse(rows_of({4, 4}, {0, 1, 2})),           // two wires in two planes
    dense(rows_of({6}, {0, 1, 2, 6})),            // compound
    sparse(rows_of({6}, {0, 1, 2, 6})),           //
    dense(rows_of({6}, {0, 1, 4, 6})),            // twin, with relative motion
    mixed(dense(rows_of({4}, {0, 1}))),           // stitched, by M: two wires
    mixed(sparse(rows_of({4}, {0, 1}))),          //
    mixed(dense(rows_of({6}, {0, 1}))),           // and three
    mixed(sparse(rows_of({6}, {0, 1}))),          //
    mixed(sparse(rows_of({8}, {0, 1}))),          // two wires in planes that arms join, by M
    sparse(rows_of({8}, {0, 1, 2, 4, 6}, true)),  // in wind
    sparse(rows_of({12}, {0, 1})),                // three wires in planes that arms join, by M
    sparse(rows_of({16}, {0, 1})),                // an overlap of such lines of two wires
    // Lines whose wires and droppers are damped each in its own way.
    dense(rows_of({2}, {0, 1}, true)),
    dense(rows_of({4}, {0, 1, 2}, true)),
    sparse(rows_of({4}, {0, 1, 2}, true)),
    dense(rows_of({6}, {0, 1, 2, 6}, true)),
    kStretching,
    kThreePlanes,
    kTensioned,
};

}  // namespace catenary
