#pragma once
// The inverse of a small matrix.
#include "base/arrays.hpp"

namespace catenary {

/// Invert in place a matrix (n, n) that needs no exchange of rows: a positive definite one, or one
/// whose masses outweigh all else.
inline void invert(Array2<double> matrix) {
    const int64_t n = matrix.rows;
    for (int64_t k = 0; k < n; ++k) {
        const auto row = matrix[k];
        const double pivot = 1.0 / row[k];
        row[k] = 1.0;
        for (int64_t j = 0; j < n; ++j) row[j] *= pivot;
        for (int64_t i = 0; i < n; ++i) {
            if (i == k) continue;
            const auto other = matrix[i];
            const double share = other[k];
            other[k] = 0.0;
            for (int64_t j = 0; j < n; ++j) other[j] -= share * row[j];
        }
    }
}

}  // namespace catenary
