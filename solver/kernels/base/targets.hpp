#pragma once
// Which compilers the kernels are written for: every other one is refused in a sentence. And loops
// of vector instructions, compiled for several processors: the loader takes the best one. With -O2
// alone GCC vectorises only loops whose length it knows. Numbers of scenes, or of tangents, stand
// side by side in the lanes of vectors.
#if defined(__clang__) ? __clang_major__ < 16 : defined(__GNUC__) && __GNUC__ < 12
#error "The kernels of Catenary need a C++20 compiler: GCC 12 or newer, or Clang 16 or newer."
#endif

#include <cstdint>
#include <type_traits>

#if defined(__x86_64__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__)
#define CATENARY_FOR_TARGETS                                                     \
    __attribute__((target_clones("default", "arch=x86-64-v3", "arch=x86-64-v4"), \
                   optimize("vect-cost-model=dynamic")))
#else
#define CATENARY_FOR_TARGETS
#endif

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
