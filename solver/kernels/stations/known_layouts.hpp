#pragma once
// Layouts that kernels are compiled for: the shipped kinds of lines.
#include <initializer_list>

#include "stations/layout.hpp"

namespace catenary {

/// Wires of unknowns: of heights and slopes; of two wires that also stretch, and move sideways.
using Wires = std::array<int8_t, kMostUnknowns>;
constexpr Wires kPairs = [] {
    Wires wires{};
    for (int u = 0; u < kMostUnknowns; ++u) wires[u] = static_cast<int8_t>(u / 2);
    return wires;
}();
constexpr Wires kStretching = {0, 0, 1, 1, 0, 1, 0, 0, 1, 1};

/// Rows and factors of the stations of a kind of line.
struct Shipped {
    Layout rows, factors;
    /// Whether such stations stand in one line with others, so that chains often go one by one.
    bool is_mixed = false;
    /// Whether kernels are compiled that step several scenes side by side.
    bool is_for_scenes = true;
};
/// Rows that join within a station unknowns whose places differ by one of these numbers, in the
/// sense of exclusive or: 1 a beam's deflection and slope, 2 the deflections of two wires. Unknowns
/// of one wire are joined from station to station. Factors join all of a plane of so many unknowns.
constexpr Shipped shipped(int unknowns, std::initializer_list<int> differences,
                          int plane = kMostUnknowns, bool is_damped = false,
                          const Wires& wires = kPairs) {
    const Pieces pieces{unknowns};
    const Mask beside = mask_of(
        pieces, [&](int i, int j) { return wires[i] == wires[j] || kPairs[i] == kPairs[j]; });
    const Mask own = mask_of(pieces, [&](int i, int j) {
        for (int d : differences)
            if ((i ^ j) == d) return true;
        return false;
    });
    const Mask whole = mask_of(pieces, [&](int i, int j) { return i / plane == j / plane; });
    return {{unknowns, own, beside, is_damped, false},
            {unknowns, whole, beside, false, true},
            false,
            !is_damped};
}
constexpr Shipped mixed(Shipped of) {
    of.is_mixed = true;
    return of;
}
/// The same stations by M, which joins a wire's own deflections and slopes only.
constexpr Shipped by_mass(Shipped of) {
    of.rows = shipped(of.rows.unknowns, {0, 1}).rows;
    return of;
}
constexpr Shipped kTensioned = [] {
    Shipped of = shipped(10, {}, kMostUnknowns, true, kStretching);
    of.rows.own = of.factors.own;
    return of;
}();

/// Stations whose unknowns are all joined within themselves, plane by plane, as by whatever hangs
/// between wires or holds them, and from station to station by the wires.
constexpr Shipped hung(int unknowns, int plane = kMostUnknowns) {
    Shipped of = shipped(unknowns, {}, plane);
    of.rows.own = of.factors.own;
    of.is_for_scenes = false;
    return of;
}

constexpr Shipped kShipped[] = {
    shipped(2, {0, 1}),                    // one wire
    shipped(4, {0, 1}, 2),                 // in two planes
    mixed(shipped(4, {0, 1, 2})),          // two wires with droppers
    mixed(shipped(8, {0, 1, 2}, 4)),       // two such lines side by side, or in two planes
    shipped(6, {0, 1, 2, 6}),              // compound
    shipped(6, {0, 1, 4, 6}),              // twin, with relative motion
    mixed(shipped(4, {0, 1})),             // stitched, by M: two wires
    mixed(shipped(6, {0, 1})),             // and three
    mixed(shipped(8, {0, 1})),             // two wires in planes that arms join, by M
    shipped(8, {0, 1, 2, 4, 6}, 8, true),  // in wind
    shipped(12, {0, 1}),                   // three wires in planes that arms join, by M
    shipped(16, {0, 1}),                   // an overlap of such lines of two wires
    // Lines whose wires and droppers are damped each in its own way.
    shipped(2, {0, 1}, 2, true),
    shipped(4, {0, 1, 2}, 4, true),
    shipped(4, {0, 1, 2, 3}, 4, true),  // and that continue behind an end
    shipped(6, {0, 1, 2, 6}, 6, true),
    // Two wires that stretch, in their plane and in three.
    by_mass(shipped(6, {}, 6, false, kStretching)),
    by_mass(kTensioned),
    kTensioned,
    // Any lines of these widths.
    hung(4),
    hung(8, 4),
    hung(6),
    hung(8),
    hung(10),
    hung(12),
};

/// Whether builds that check each access have kernels of their own for one of them: with checks
/// they take long to compile, and their source is the same for all. Other builds have all.
constexpr bool is_checked([[maybe_unused]] const Shipped& of) {
#if defined(CATENARY_CHECKS)
    return of.rows == shipped(4, {0, 1, 2}).rows;  // two wires with droppers
#else
    return true;
#endif
}

/// The layout of the least products among those that kernels were compiled for which has all of a
/// layout's: stations without kernels of their own take twice as long as with some that make as
/// many products. If there is none, the wanted one with all products of its squares: general
/// kernels make all of a square at once.
constexpr Layout fitting(const Layout& wanted) {
    Layout found = wanted;
    found.own = in_squares(wanted.pieces(), wanted.own);
    found.beside = in_squares(wanted.pieces(), wanted.beside);
    int least = 3 * wanted.of_row();
    for (const Shipped& one : kShipped)
        for (const Layout& layout : {one.rows, one.factors})
            if (layout.holds(wanted) && layout.of_row() < least) {
                found = layout;
                least = layout.of_row();
            }
    return found;
}

}  // namespace catenary
