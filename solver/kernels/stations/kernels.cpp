// Chooses kernels by layout and by processor.
#include <algorithm>
#include <string>

#include "stations/known_layouts.hpp"
#include "stations/line.hpp"
#include "stations/targets.hpp"

#define CATENARY_DECLARE(target)                                                        \
    namespace catenary::target {                                                        \
    std::unique_ptr<Kernels> make(const Layout& rows, const Layout& factors);           \
    std::unique_ptr<Kernels> make_for_scenes(const Layout& rows, const Layout& factors, \
                                             int scenes);                               \
    }
CATENARY_DECLARE(baseline)
#ifdef CATENARY_X86_TARGETS
CATENARY_DECLARE(avx2)
CATENARY_DECLARE(avx512)
#endif

namespace catenary {

namespace {

struct Target {
    std::string name;
    decltype(&baseline::make) make;
    decltype(&baseline::make_for_scenes) make_for_scenes;
};

/// Targets that this processor can run, the best last.
const std::vector<Target>& of_processor() {
    static const std::vector<Target> found = [] {
        std::vector<Target> targets{{"baseline", baseline::make, baseline::make_for_scenes}};
#ifdef CATENARY_X86_TARGETS
        __builtin_cpu_init();
        if (__builtin_cpu_supports("x86-64-v3"))
            targets.push_back({"avx2", avx2::make, avx2::make_for_scenes});
        if (__builtin_cpu_supports("x86-64-v4"))
            targets.push_back({"avx512", avx512::make, avx512::make_for_scenes});
#endif
        return targets;
    }();
    return found;
}

const Target*& chosen() {
    static const Target* target = &of_processor().back();
    return target;
}

}  // namespace

std::vector<std::string> targets() {
    std::vector<std::string> names;
    for (const Target& target : of_processor()) names.push_back(target.name);
    return names;
}

bool set_target(const std::string& name) {
    for (const Target& target : of_processor())
        if (target.name == name) {
            chosen() = &target;
            return true;
        }
    return false;
}

std::unique_ptr<Kernels> kernels_of(const Layout& rows, const Layout& factors) {
    if (rows.unknowns != factors.unknowns) return nullptr;
    return chosen()->make(rows, factors);
}

std::unique_ptr<Kernels> kernels_for_scenes(const Layout& rows, const Layout& factors, int scenes) {
    return chosen()->make_for_scenes(rows, factors, scenes);
}

std::unique_ptr<Kernels> kernels_of_rows(const Layout& rows) {
    for (const Shipped& shipped : kShipped)
        if (shipped.rows == rows) return kernels_of(rows, shipped.factors);
    Layout factors;
    factors.unknowns = rows.unknowns;
    return kernels_of(rows, factors);
}

std::unique_ptr<Kernels> kernels_of_factors(const Layout& factors) {
    Layout rows;
    rows.unknowns = factors.unknowns;
    return kernels_of(rows, factors);
}

}  // namespace catenary
