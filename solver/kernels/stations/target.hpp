#pragma once
// All kernels for one target. A target is an instruction set: files that include this set it by a
// pragma, after the headers of the standard library.
#include "stations/known_layouts.hpp"
#include "stations/passes.hpp"

namespace catenary::CATENARY_TARGET {

/// General kernels for the lanes of these rows, with masks found at run time.
template <int W = 2>
std::unique_ptr<Kernels> make_general(const Layout& rows, const Layout& factors) {
    if (rows.pieces().lanes() == W)
        return std::make_unique<KernelsOf<Blocks<W, GivenMasks>>>(rows, factors);
    if constexpr (W < kMostUnknowns)
        return make_general<W + (W < 16 ? 2 : 4)>(rows, factors);
    else
        return nullptr;
}

/// Whether kernels are compiled for one of the shipped lines.
constexpr bool is_compiled([[maybe_unused]] const Shipped& of) {
#if defined(CATENARY_GENERAL_ONLY)
    return false;  // where processors differ much the oldest has the general kernels only
#else
    return is_checked(of);
#endif
}

/// Kernels that were compiled for both, or null.
template <int K = 0>
std::unique_ptr<Kernels> make_quick(const Layout& rows, const Layout& factors) {
    if constexpr (K < std::size(kShipped)) {
        constexpr Shipped s = kShipped[K];
        if constexpr (is_compiled(s)) {
            using Known = Blocks<s.rows.unknowns, KnownMasks<K>>;
            if (rows == s.rows && factors == s.factors)
                return std::make_unique<QuickKernels<Known, s.is_mixed>>(
                    rows, factors, make_general(rows, factors));
        }
        return make_quick<K + 1>(rows, factors);
    }
    return nullptr;
}

std::unique_ptr<Kernels> make(const Layout& rows, const Layout& factors) {
    auto quick = make_quick(rows, factors);
    return quick ? std::move(quick) : make_general(rows, factors);
}

}  // namespace catenary::CATENARY_TARGET
