// Points, row by row.
#include "views/points.hpp"

namespace catenary {

void take_points(Array2<const double> rows, std::span<const int64_t> columns,
                 std::span<const int64_t> first, std::span<const int64_t> count,
                 std::span<double> result) {
    size_t at = 0;
    for (int64_t i = 0; i < size(first); ++i) {
        const auto row = rows[i];
        for (const int64_t column : columns.subspan(first[i], count[i]))
            result[at++] = column >= 0 ? row[column] : 0.0;
    }
}

}  // namespace catenary
