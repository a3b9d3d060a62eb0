#pragma once
// Products and factors as Python gives them; see StationProduct and StationFactors.
#include "base/arrays.hpp"
#include "base/record.hpp"
#include "stations/line.hpp"

namespace catenary {

/// Begins of stations in vectors, and the station type of each; both empty if all are alike.
struct Sections {
    std::span<const int64_t> starts;
    std::span<const uint8_t> station_type;
    CATENARY_RECORD(starts, station_type)

    Places places() const {
        return starts.empty() ? Places{} : Places{starts.data(), station_type.data()};
    }
};

/// Rows of a product: of each the place of its first number; the first row's station in `sections`.
struct ProductArrays {
    std::span<const int32_t> kinds;
    std::span<const double> blocks;
    int64_t first;
    Sections sections;
    CATENARY_RECORD(kinds, blocks, first, sections)

    Product product() const {
        return {.rows = {kinds.data(), blocks.data()}, .first = first, .places = sections.places()};
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

    Factored factored() const {
        return {{kinds.data(), blocks.data()},
                {beside_kinds.data(), besides.data()},
                sections.places()};
    }
    const Ends& at() const { return *reinterpret_cast<const Ends*>(ends.data()); }
};

}  // namespace catenary
