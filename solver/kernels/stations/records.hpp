#pragma once
// Products and factors as Python gives them; see StationProduct and StationFactors.
#include <stdexcept>
#include <vector>

#include "base/arrays.hpp"
#include "stations/line.hpp"

namespace catenary {

/// Throws std::invalid_argument unless `numbers` hold those of each station from its one of
/// `begins` on, of which a station of type t has sizes[t].
inline void check_table(std::span<const int32_t> begins, std::span<const double> numbers,
                        std::span<const uint8_t> station_type, const std::vector<int64_t>& sizes) {
    for (int64_t i = 0; i < size(begins); ++i) {
        const int64_t end = begins[i] + sizes.at(station_type.empty() ? 0 : station_type[i]);
        if (begins[i] < 0 || end > size(numbers))
            throw std::invalid_argument("stations have more numbers than their blocks");
    }
}

/// Rows of a product: of each the place of its first number; the first row's station in `sections`.
struct ProductArrays {
    std::span<const int32_t> kinds;
    std::span<const double> blocks;
    int64_t first;
    Sections sections;
    CATENARY_RECORD(kinds, blocks, first, sections)
    CATENARY_SHAPES("n, *, *, *")

    /// Throws std::invalid_argument if there are fewer stations than rows and one at both ends, or
    /// if blocks have fewer numbers than rows of these layouts.
    Product product(const std::vector<Layout>& layouts) const {
        const int64_t n_stations = size(sections.starts);
        if (first < 0 || (n_stations > 0 && n_stations < first + size(kinds) + 1))
            throw std::invalid_argument("a product has fewer stations than rows");
        std::vector<int64_t> sizes;
        for (const Layout& layout : layouts)
            sizes.push_back((layout.is_damped ? 2 : 1) * layout.of_row() *
                            layout.pieces().vector());
        const auto types = sections.station_type;
        check_table(kinds, blocks, types.empty() ? types : part(types, first, size(types)), sizes);
        return {.rows = {kinds.data(), blocks.data()}, .first = first, .places = sections};
    }
};

/// Factors: of each station the place of its first number, and the same of the matrix's own blocks.
struct FactorArrays {
    std::span<const int32_t> kinds;
    std::span<const double> blocks;
    std::span<const int32_t> beside_kinds;
    std::span<const double> besides;
    int64_t low;                    ///< first station of a rank's own
    std::span<const int64_t> ends;  ///< of `Ends`
    Sections sections;
    CATENARY_RECORD(kinds, blocks, beside_kinds, besides, low, ends, sections)
    CATENARY_SHAPES("n, *, n, *, *, 5, n=n?")

    /// Throws std::invalid_argument if blocks have fewer numbers than factors of these layouts.
    Factored factored(const std::vector<Layout>& layouts) const {
        std::vector<int64_t> inverse, besides_of_both;
        for (const Layout& layout : layouts) {
            inverse.push_back(layout.size_of(upper(layout.own)) +
                              (layout.is_sparse() ? 0 : layout.size_of(layout.own)));
            besides_of_both.push_back(2 * layout.size_of(layout.beside));
        }
        check_table(kinds, blocks, sections.station_type, inverse);
        check_table(beside_kinds, besides, sections.station_type, besides_of_both);
        return {{kinds.data(), blocks.data()}, {beside_kinds.data(), besides.data()}, sections};
    }
    const Ends& at() const { return *reinterpret_cast<const Ends*>(ends.data()); }
};

}  // namespace catenary
