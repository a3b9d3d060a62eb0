// Extremes and points, row by row.
#include "views/extremes.hpp"

#include "base/targets.hpp"

namespace catenary {

CATENARY_FOR_TARGETS
void take_extremes(Array2<const double> rows, int64_t first, int64_t begin, int64_t end,
                   Array2<double> kept) {
    const auto smallest = part(kept[0], begin, end), largest = part(kept[1], begin, end);
    for (int64_t i = 0; i < rows.rows; ++i) {
        const auto row = part(rows[i], first + begin, first + end);
        // Written at any rate, so that it becomes a loop of vector instructions.
        for (size_t j = 0; j < row.size(); ++j) {
            const double value = row[j], low = smallest[j], high = largest[j];
            smallest[j] = value < low ? value : low;
            largest[j] = value > high ? value : high;
        }
    }
}

void take_points(Array2<const double> rows, std::span<const int64_t> columns,
                 std::span<const int64_t> first, std::span<const int64_t> count,
                 std::span<double> result) {
    int64_t at = 0;
    for (int64_t i = 0; i < size(first); ++i) {
        const auto row = rows[i];
        const auto points = part(result, at, at + count[i]);
        const auto of = part(columns, first[i], first[i] + count[i]);
        for (int64_t k = 0; k < count[i]; ++k) points[k] = of[k] >= 0 ? row[of[k]] : 0.0;
        at += count[i];
    }
}

}  // namespace catenary
