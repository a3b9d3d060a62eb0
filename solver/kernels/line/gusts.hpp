#pragma once
// Amplitudes of gusts along a line, and the waves that they make. See gust_field.py.
#include "base/arrays.hpp"

namespace catenary {

/// Fill `out` (m, k) with values at m points between two posts of k first-order Gauss-Markov
/// processes, which are `first` and `last` at the posts and decay as exp(-rate d), rates in 1/m.
/// `steps` (m + 1,) are from the first post to the point after it, and so on to the last post [m];
/// `normals` (m, k) standard normal numbers.
void bridge(std::span<const double> first, std::span<const double> last,
            std::span<const double> rates, std::span<const double> steps,
            Array2<const double> normals, Array2<double> out);

/// Add waves (s, k) times amplitudes (k, m) to `out` (s, m), in one order for any s and m.
void add_waves(Array2<const double> waves, Array2<const double> amplitudes, Array2<double> out);

}  // namespace catenary
