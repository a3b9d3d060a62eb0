// Band matrices factored, and right sides in the lanes of vectors.
#include "line/bands.hpp"

#include <algorithm>
#include <vector>

#include "base/targets.hpp"

namespace catenary {

namespace {

/// Right sides that are solved for at once.
constexpr int64_t kAtOnce = 8;

/// Factor a matrix whose columns `factors` (m, k) holds, from the diagonal down and zero beyond the
/// last row. Each column then has 1 / D and the column of L; false if D is not positive.
bool factor(Array2<double> factors) {
    const int64_t m = factors.rows, k = factors.columns;
    for (int64_t j = 0; j < m; ++j) {
        double* const column = &factors(j, 0);
        if (!(column[0] > 0.0)) return false;
        column[0] = 1.0 / column[0];
        for (int64_t i = 1; i < std::min(k, m - j); ++i) {
            const double share = column[i] * column[0];
            double* const other = &factors(j + i, 0);
            for (int64_t p = i; p < k; ++p) other[p - i] -= share * column[p];
            column[i] = share;
        }
    }
    return true;
}

/// Solve for `kAtOnce` right sides, one beside the other; `rows` has k rows of zeros at its end.
CATENARY_FOR_TARGETS
void solve(Array2<const double> factors, std::vector<double>& rows) {
    const int64_t m = factors.rows, k = factors.columns;
    for (int64_t j = 0; j < m; ++j) {
        const double* const column = &factors(j, 0);
        double* const own = &rows[j * kAtOnce];
        for (int64_t i = 1; i < k; ++i)
            for (int64_t s = 0; s < kAtOnce; ++s) own[i * kAtOnce + s] -= column[i] * own[s];
    }
    for (int64_t j = m - 1; j >= 0; --j) {
        const double* const column = &factors(j, 0);
        double* const own = &rows[j * kAtOnce];
        for (int64_t s = 0; s < kAtOnce; ++s) own[s] *= column[0];
        for (int64_t i = 1; i < k; ++i)
            for (int64_t s = 0; s < kAtOnce; ++s) own[s] -= column[i] * own[i * kAtOnce + s];
    }
}

}  // namespace

bool solve_bands(Array2<const double> bands, Array2<double> right) {
    const int64_t k = bands.rows, m = bands.columns;
    std::vector<double> numbers(m * k);
    for (int64_t j = 0; j < m; ++j)
        for (int64_t i = 0; i < std::min(k, m - j); ++i) numbers[j * k + i] = bands(i, j);
    const Array2<double> factors{numbers.data(), m, k};
    if (!factor(factors)) return false;
    std::vector<double> rows((m + k) * kAtOnce);
    for (int64_t first = 0; first < right.rows; first += kAtOnce) {
        const int64_t n = std::min(kAtOnce, right.rows - first);
        for (int64_t j = 0; j < m; ++j)
            for (int64_t s = 0; s < n; ++s) rows[j * kAtOnce + s] = right(first + s, j);
        solve({factors.data, m, k}, rows);
        for (int64_t s = 0; s < n; ++s)
            for (int64_t j = 0; j < m; ++j) right(first + s, j) = rows[j * kAtOnce + s];
    }
    return true;
}

}  // namespace catenary
