#pragma once
// All kernels for one target. A target is what a processor is told to be: files that include this
// set it by a pragma, after the headers of the standard library.
#include "stations/known_layouts.hpp"
#include "stations/passes.hpp"

namespace catenary::CATENARY_TARGET {

/// General kernels of as many vectors as stations need; null if these are too many.
template <int N = 1>
std::unique_ptr<Kernels> make_general(const Layout& rows, const Layout& factors) {
    if (rows.n_lanes() <= 4 * N)
        return std::make_unique<KernelsOf<GeneralBlocks<N>>>(rows, factors);
    if constexpr (4 * N < kMostLanes)
        return make_general<N + 1>(rows, factors);
    else
        return nullptr;
}

// Where processors differ much the oldest has the general kernels only.
#if defined(CATENARY_GENERAL_ONLY)
constexpr bool kHasKnown = false;
#else
constexpr bool kHasKnown = true;
#endif

/// Kernels of rows of these widths, whatever they join; null if none were compiled.
template <int K = 0>
std::unique_ptr<Kernels> make_listed(const Layout& rows, const Layout& factors) {
    if constexpr (kHasKnown && K < std::size(kWidths)) {
        constexpr Layout r = listed_rows(kWidths[K]);
        if (rows.widths != r.widths) return make_listed<K + 1>(rows, factors);
        if constexpr (r.widths == kTensioned.factors.widths)
            if (factors.strands[0][0])
                return std::make_unique<KernelsOf<KnownBlocks<r, kTensioned.factors>>>(rows,
                                                                                       factors);
        if (factors.sparse)
            return std::make_unique<KernelsOf<KnownBlocks<r, listed_factors(r)>>>(rows, factors);
        return std::make_unique<KernelsOf<KnownBlocks<r, dense_factors(r)>>>(rows, factors);
    }
    return nullptr;
}

/// Kernels that were compiled for both, or null.
template <int K = 0>
std::unique_ptr<Kernels> make_quick(const Layout& rows, const Layout& factors) {
    if constexpr (kHasKnown && K < std::size(kShipped)) {
        constexpr Shipped s = kShipped[K];
        if (rows == s.rows && factors == s.factors)
            return std::make_unique<QuickKernels<KnownBlocks<s.rows, s.factors>, s.is_mixed>>(
                rows, factors, make_listed(rows, factors));
        return make_quick<K + 1>(rows, factors);
    }
    return nullptr;
}

std::unique_ptr<Kernels> make(const Layout& rows, const Layout& factors) {
    if (rows.general) return make_general(rows, factors);
    auto quick = make_quick(rows, factors);
    return quick ? std::move(quick) : make_listed(rows, factors);
}

}  // namespace catenary::CATENARY_TARGET
