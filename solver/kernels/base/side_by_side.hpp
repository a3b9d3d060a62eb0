#pragma once
// Numbers of scenes, or of tangents, that stand side by side in the lanes of vectors.
#include <cstdint>
#include <type_traits>

namespace catenary {

/// Scenes that kernels step side by side: four, or eight where vectors hold them.
constexpr int kScenes = 4, kMostScenes = 8;

/// Numbers in L lanes as a vector, and as they stand in memory, aligned as doubles: a reference to
/// these names its type, as `auto&` forgets the alignment.
template <int64_t L>
struct SideBySide {
    typedef double Numbers __attribute__((vector_size(8 * L)));
    typedef double InMemory __attribute__((vector_size(8 * L), aligned(8), may_alias));
    static InMemory& at(double* numbers) { return *reinterpret_cast<InMemory*>(numbers); }
    static const InMemory& at(const double* numbers) {
        return *reinterpret_cast<const InMemory*>(numbers);
    }
};
template <>
struct SideBySide<1> {
    using Numbers = double;
    using InMemory = double;
    static double& at(double* numbers) { return *numbers; }
    static double at(const double* numbers) { return *numbers; }
};

/// Call a function with the number of lanes, 1, `kScenes` or `kMostScenes`, as a constant.
template <class F>
[[gnu::always_inline]] inline void with_lanes(int64_t n, F&& function) {
    if (n == 1) return function(std::integral_constant<int64_t, 1>{});
    if (n == kScenes) return function(std::integral_constant<int64_t, kScenes>{});
    function(std::integral_constant<int64_t, kMostScenes>{});
}

}  // namespace catenary
