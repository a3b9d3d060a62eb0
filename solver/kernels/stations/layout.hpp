#pragma once
// How the unknowns of a station stand in vector lanes, and which products with blocks need.
//
// Planes are sets of unknowns that no matrix joins. They stand side by side, each in as many lanes
// as it needs. A block of a matrix is kept by terms: each joins lanes whose places in their plane
// differ by one number, in the sense of exclusive or: 0 those with themselves, 1 a beam's
// deflection and slope, 2 the deflections of two wires. `station_layout.py` packs blocks in this
// order; what is constant here is known when the kernels are compiled.
#include <array>
#include <cstdint>

namespace catenary {

constexpr int kMostPlanes = 8, kMostLanes = 32, kMostTerms = 16, kMostStrands = 4;
constexpr int kRegister = 8;  // lanes that stand together in a packed block, at most

constexpr int power_of_two_from(int n) {
    int power = 1;
    while (power < n) power *= 2;
    return power;
}

/// Unknowns of each plane, 0 after the last.
using Widths = std::array<int8_t, kMostPlanes>;

/// Which unknowns of a station matrices join. See `Layout` of station_layout.py.
struct Layout {
    Widths widths{};
    uint32_t own = 0, beside = 0;  ///< terms of blocks, a bit for each difference
    bool damped = false;           ///< whether rows hold -C as well as K
    bool sparse = false;           ///< whether factors keep the matrix's own blocks
    bool general = false;          ///< whether its widths are known at run time only
    bool by_lists = false;         ///< whether its differences are
    /// Unknowns + 1 of each strand, 0 after the last.
    std::array<std::array<int8_t, kMostTerms>, kMostStrands> strands{};

    constexpr bool operator==(const Layout&) const = default;

    constexpr int n_planes() const {
        int n = 0;
        while (n < kMostPlanes && widths[n]) ++n;
        return n;
    }
    constexpr int pitch() const {
        int n = 0;
        for (int width : widths) n += width;
        return n;
    }
    constexpr int widest() const {
        int most = 0;
        for (int width : widths) most = width > most ? width : most;
        return most;
    }
    constexpr int plane_lanes(int plane) const {
        if (general) return (widths[plane] + 3) / 4 * 4;
        for (int lanes : {2, 4, 6, 8, 10, 12, 16})
            if (widths[plane] <= lanes) return lanes;
        return -1;
    }
    constexpr int first_lane(int plane) const {
        int n = 0;
        for (int p = 0; p < plane; ++p) n += plane_lanes(p);
        return n;
    }
    constexpr int first_unknown(int plane) const {
        int n = 0;
        for (int p = 0; p < plane; ++p) n += widths[p];
        return n;
    }
    constexpr int n_lanes() const { return first_lane(n_planes()); }
    constexpr int plane_of(int lane) const {
        int plane = 0;
        while (lane >= first_lane(plane + 1)) ++plane;
        return plane;
    }
    /// Unknown of a lane, -1 if it has none.
    constexpr int unknown(int lane) const {
        const int plane = plane_of(lane), place = lane - first_lane(plane);
        return place < widths[plane] ? first_unknown(plane) + place : -1;
    }
    constexpr int lane_of(int wanted) const {
        for (int lane = 0; lane < n_lanes(); ++lane)
            if (unknown(lane) == wanted) return lane;
        return -1;
    }
    /// Least power of two of lanes that holds a plane.
    constexpr int largest() const {
        int most = 0;
        for (int p = 0; p < n_planes(); ++p) most = plane_lanes(p) > most ? plane_lanes(p) : most;
        return power_of_two_from(most);
    }
    /// Whether lanes 0 and 1, 2 and 3 and so on of a second sum are exchanged at its end.
    constexpr bool turns() const {
        return !general && largest() <= kRegister && widest() > largest() - 2;
    }
};

/// Lanes of each register, whose numbers of a packed block stand together.
struct Registers {
    std::array<int8_t, kMostLanes / 2> size{};
    int n = 0;
};

constexpr Registers registers_of(const Layout& layout) {
    Registers found;
    auto cut = [&found](int lanes, int most) {
        while (lanes) {
            int size = 1;
            while (2 * size <= lanes && 2 * size <= most) size *= 2;
            found.size[found.n++] = static_cast<int8_t>(size);
            lanes -= size;
        }
    };
    const int first = layout.plane_lanes(0);
    bool alike = first == power_of_two_from(first);
    for (int p = 0; p < layout.n_planes(); ++p) alike = alike && layout.plane_lanes(p) == first;
    if (layout.general)
        cut(layout.n_lanes(), 4);
    else if (alike)
        cut(layout.n_lanes(), kRegister);
    else
        for (int p = 0; p < layout.n_planes(); ++p) cut(layout.plane_lanes(p), kRegister);
    return found;
}

/// What a block times a vector is the sum of, and how its numbers are stored. There are two sums,
/// which a processor works on side by side.
struct Terms {
    int n = 0;
    std::array<std::array<int8_t, kMostLanes>, kMostTerms> source{};  ///< lane, -1 if there is none
    std::array<int8_t, kMostTerms> sum{};                             ///< which sum, 0 or 1
    /// Where the numbers of each register and term begin, -1 if there are none.
    std::array<std::array<int16_t, kMostTerms>, kMostLanes / 2> begin{};
    int size = 0;  ///< numbers of the block
};

/// Numbers of a register stand together, those of the largest ones first.
constexpr void put_in_order(const Layout& layout, Terms& terms) {
    const Registers registers = registers_of(layout);
    int end = 0, largest = 1;
    for (int size = kRegister; size; size /= 2)
        for (int r = registers.n - 1; r >= 0; --r) {
            if (registers.size[r] != size) continue;
            largest = size > largest ? size : largest;
            int first = 0;
            for (int q = 0; q < r; ++q) first += registers.size[q];
            for (int k = 0; k < terms.n; ++k) {
                bool any = false;
                for (int lane = first; lane < first + size; ++lane)
                    any = any || terms.source[k][lane] >= 0;
                terms.begin[r][k] = static_cast<int16_t>(any ? end : -1);
                if (any) end += size;
            }
        }
    terms.size = (end + largest - 1) / largest * largest;
}

/// Terms of the differences whose bits are set.
constexpr Terms terms_of(const Layout& layout, uint32_t differences) {
    Terms terms;
    for (int d = 0; d < kMostTerms; ++d) {
        if (!(differences >> d & 1)) continue;
        // An odd difference is an even one of sources, and an exchange at the end: few are
        // exchanged.
        const int apart = layout.turns() ? d & ~1 : d;
        for (int lane = 0; lane < layout.n_lanes(); ++lane) {
            const int plane = layout.plane_of(lane), first = layout.first_lane(plane);
            const int other = first + ((lane - first) ^ apart);
            const bool there = other < first + layout.plane_lanes(plane);
            terms.source[terms.n][lane] = static_cast<int8_t>(there ? other : -1);
        }
        terms.sum[terms.n] = static_cast<int8_t>(layout.turns() ? d & 1 : terms.n % 2);
        ++terms.n;
    }
    put_in_order(layout, terms);
    return terms;
}

constexpr Terms own_terms(const Layout& layout) {
    return terms_of(layout, layout.own);
}

/// Of a block that joins all unknowns of each plane.
constexpr Terms whole_terms(const Layout& layout) {
    if (layout.turns() || layout.general) return terms_of(layout, (1u << layout.largest()) - 1);
    Terms terms;
    terms.n = layout.widest();
    for (int column = 0; column < terms.n; ++column) {
        for (int lane = 0; lane < layout.n_lanes(); ++lane) {
            const int plane = layout.plane_of(lane);
            const bool there = column < layout.plane_lanes(plane);
            terms.source[column][lane] =
                static_cast<int8_t>(there ? layout.first_lane(plane) + column : -1);
        }
        terms.sum[column] = static_cast<int8_t>(column % 2);
    }
    put_in_order(layout, terms);
    return terms;
}

/// Of a block that joins a station to one beside it: by differences, or by the columns of strands.
constexpr Terms beside_terms(const Layout& layout) {
    if (!layout.strands[0][0]) return terms_of(layout, layout.beside);
    Terms terms;
    for (auto& lanes : terms.source) lanes.fill(-1);
    for (const auto& strand : layout.strands) {
        int n = 0;
        while (n < kMostTerms && strand[n]) ++n;
        terms.n = n > terms.n ? n : terms.n;
        for (int column = 0; column < n; ++column)
            for (int row = 0; row < n; ++row)
                terms.source[column][layout.lane_of(strand[row] - 1)] =
                    static_cast<int8_t>(layout.lane_of(strand[column] - 1));
    }
    for (int k = 0; k < terms.n; ++k)
        terms.sum[k] = static_cast<int8_t>(layout.turns() ? 0 : k % 2);
    put_in_order(layout, terms);
    return terms;
}

/// A symmetric block of which one half is stored: term d has the unknown that is d places further,
/// round and round in its plane. Where it is mirrored, lane `back` of its numbers times the vector
/// is what the other half makes.
struct Halves {
    Terms terms;
    std::array<bool, kMostTerms> mirrored{};
    std::array<std::array<int8_t, kMostLanes>, kMostTerms> back{};
};

constexpr Halves halves_of(const Layout& layout) {
    Halves halves;
    Terms& terms = halves.terms;
    terms.n = layout.widest() / 2 + 1;
    for (int d = 0; d < terms.n; ++d) {
        for (int lane = 0; lane < layout.n_lanes(); ++lane) {
            terms.source[d][lane] = -1;
            halves.back[d][lane] = static_cast<int8_t>(lane);
        }
        halves.mirrored[d] = d >= 1 && d < (layout.widest() + 1) / 2;
        terms.sum[d] = static_cast<int8_t>(layout.turns() ? 0 : d % 2);
    }
    for (int plane = 0; plane < layout.n_planes(); ++plane) {
        const int width = layout.widths[plane], first = layout.first_lane(plane);
        for (int d = 0; d <= width / 2; ++d)
            for (int place = 0; place < width; ++place) {
                const int other = first + (place + d) % width;
                terms.source[d][first + place] = static_cast<int8_t>(other);
                halves.back[d][other] = static_cast<int8_t>(first + place);
            }
    }
    put_in_order(layout, terms);
    return halves;
}

/// Numbers of a station's packed row of K, and of -C.
constexpr int row_size(const Layout& layout) {
    return (own_terms(layout).size + 2 * beside_terms(layout).size) * (layout.damped ? 2 : 1);
}
/// Numbers of a station's packed factors.
constexpr int factor_size(const Layout& layout) {
    if (!layout.sparse) return 3 * whole_terms(layout).size;
    return layout.general ? whole_terms(layout).size : halves_of(layout).terms.size;
}

}  // namespace catenary
