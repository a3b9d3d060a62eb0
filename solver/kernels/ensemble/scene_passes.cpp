// Free steps of several scenes, with reserves and extremes of all of them at once.
#include "ensemble/scene_passes.hpp"

#include <algorithm>
#include <limits>
#include <stdexcept>

#include "base/targets.hpp"

namespace catenary {

namespace {

/// Numbers of all scenes as a vector, aligned as doubles.
typedef double Scenes __attribute__((vector_size(8 * kScenes), aligned(8), may_alias));

const Scenes& at(const double* numbers) {
    return *reinterpret_cast<const Scenes*>(numbers);
}
Scenes& at(double* numbers) {
    return *reinterpret_cast<Scenes*>(numbers);
}

/// Fill in the reserve of each link from `begin` to `end` in all scenes, from the reserves at rest.
CATENARY_FOR_TARGETS
void find_reserves(const Motion& motion, const Links& links, const double* rest, int64_t begin,
                   int64_t end, double* result) {
    const double *x = motion.x.data(), *y = motion.y.data(), *z = motion.z.data();
    const double *s = motion.shares.data(), *weight = links.weights.data;
    const int64_t* unknown = links.unknowns.data;
    const int64_t m = links.unknowns.columns;
    for (int64_t link = begin; link < end; ++link) {
        Scenes of_x{}, of_y{}, of_z{};
        for (int64_t k = m * link; k < m * (link + 1); ++k) {
            const int64_t place = unknown[k] * kScenes;
            of_x += weight[k] * at(x + place);
            of_y += weight[k] * at(y + place);
            of_z += weight[k] * at(z + place);
        }
        const Reserve& law = links.law[link];
        const Scenes stretch = s[0] * of_x + s[1] * of_y + s[2] * of_z;
        at(result + kScenes * link) = at(rest + kScenes * link) + law.stiffness * stretch +
                                      law.damping * (s[3] * of_y + s[4] * of_z);
    }
}

/// Take forces of links with these reserves into their extremes. `none` (kScenes,) is 0 of scenes
/// that take part, infinite of the others.
CATENARY_FOR_TARGETS
void take_forces(std::span<const Reserve> laws, const double* reserves, const double* none,
                 double* least, double* largest) {
    const Scenes left_out = at(none), nothing{};
    for (int64_t link = 0; link < size(laws); ++link) {
        const Reserve& law = laws[link];
        const Scenes reserve = at(reserves + kScenes * link);
        const Scenes whole = law.carried * reserve, part = whole - law.released * reserve;
        const Scenes force = reserve < nothing ? part : whole;
        Scenes &low = at(least + kScenes * link), &high = at(largest + kScenes * link);
        const Scenes down = force + left_out, up = force - left_out;
        low = down < low ? down : low;
        high = up > high ? up : high;
    }
}

/// Take displacements of unknowns into their largest ones, as `take_forces`.
CATENARY_FOR_TARGETS
void take_uplift(const Motion& motion, std::span<const int64_t> unknowns, const double* none,
                 double* largest) {
    const double *x = motion.x.data(), *y = motion.y.data(), *z = motion.z.data();
    const double* s = motion.shares.data();
    const Scenes left_out = at(none);
    for (int64_t arm = 0; arm < size(unknowns); ++arm) {
        const int64_t place = unknowns[arm] * kScenes;
        const Scenes now = s[0] * at(x + place) + s[1] * at(y + place) + s[2] * at(z + place);
        const Scenes up = now - left_out;
        Scenes& high = at(largest + kScenes * arm);
        high = up > high ? up : high;
    }
}

}  // namespace

ScenePasses::ScenePasses(PassParts parts) : parts_(std::move(parts)), line_(parts_, kScenes) {
    if (!parts_.arrays.known.empty())
        throw std::invalid_argument("scenes side by side take steps of Newmark's method only");
}

void ScenePasses::track(const TrackedLinks& tracked, Array2<const double> rest,
                        std::vector<std::span<double>> reserves) {
    if (reserves.size() != kScenes || rest.columns != kScenes)
        throw std::invalid_argument("a scene has no reserves");
    tracked_ = tracked;
    rest_ = rest;
    reserves_ = std::move(reserves);
    make_room(tracked.links.law.size());
}

void ScenePasses::make_room(size_t n_links) {
    found_.resize(std::max(found_.size(), n_links * kScenes));
}

void ScenePasses::step() {
    line_.line.step(line_.work, parts_.factors.at(), std::max<int64_t>(1, tracked_.stretch), *this);
}

void ScenePasses::after_stretch() {
    part(tracked_.ranges.all(), 2 * n_followed_, 2 * n_followed_ + 4);
    const auto before = tracked_.ranges[n_followed_], now = tracked_.ranges[n_followed_ + 1];
    ++n_followed_;
    find_reserves(now[0], before[0]);
    find_reserves(before[1], now[1]);
}

void ScenePasses::find_reserves(int64_t begin, int64_t end) {
    catenary::find_reserves(parts_.arrays.motion, tracked_.links, rest_.data, begin, end,
                            found_.data());
    for (int64_t link = begin; link < end; ++link)
        for (int s = 0; s < kScenes; ++s) reserves_[s][link] = found_[kScenes * link + s];
}

void ScenePasses::take(const LineExtremes& extremes, const std::array<bool, kScenes>& moves) {
    double none[kScenes];
    for (int s = 0; s < kScenes; ++s)
        none[s] = moves[s] ? 0.0 : std::numeric_limits<double>::infinity();
    const Motion& motion = parts_.arrays.motion;
    take_uplift(motion, extremes.arms, none, extremes.uplift.data);
    const auto laws = extremes.droppers.law;
    catenary::find_reserves(motion, extremes.droppers, extremes.rest.data, 0, size(laws),
                            found_.data());
    take_forces(laws, found_.data(), none, extremes.least.data, extremes.largest.data);
}

void ScenePasses::rest(int scene) const {
    if (scene < 0 || scene >= kScenes) throw std::out_of_range("there is no such scene");
    const PassArrays& arrays = parts_.arrays;
    auto clear = [scene](std::span<double> numbers) {
        for (size_t at = scene; at < numbers.size(); at += kScenes) numbers[at] = 0.0;
    };
    for (auto numbers : {arrays.factor, arrays.velocity, arrays.answer}) clear(numbers);
    for (auto numbers : {arrays.motion.x, arrays.motion.y, arrays.motion.z}) clear(numbers);
}

}  // namespace catenary
