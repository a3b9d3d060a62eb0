// Free steps of several scenes, with reserves and extremes of all of them at once; and steps of all
// lanes, each as far as its scene goes.
#include "ensemble/ensemble.hpp"

#include <algorithm>
#include <limits>
#include <stdexcept>

#include "base/flush_to_zero.hpp"
#include "base/targets.hpp"

namespace catenary {

namespace {

/// Fill in the reserve of each link from `begin` to `end` in all scenes, from the reserves at rest.
CATENARY_FOR_TARGETS
void find_reserves(const Motion& motion, const Links& links, const double* rest, int64_t begin,
                   int64_t end, double* result) {
    with_lanes(motion.spacing, [&](auto lanes) __attribute__((always_inline)) {
        using Scenes = SideBySide<lanes>;
        const double *x = motion.x.data(), *y = motion.y.data(), *z = motion.z.data();
        const double *s = motion.shares.data(), *weight = links.weights.data;
        const int64_t* unknown = links.unknowns.data;
        const int64_t m = links.unknowns.columns;
        for (int64_t link = begin; link < end; ++link) {
            typename Scenes::Numbers of_x{}, of_y{}, of_z{};
            for (int64_t k = m * link; k < m * (link + 1); ++k) {
                const int64_t place = unknown[k] * lanes;
                of_x += weight[k] * Scenes::at(x + place);
                of_y += weight[k] * Scenes::at(y + place);
                of_z += weight[k] * Scenes::at(z + place);
            }
            const Reserve& law = links.law[link];
            const auto stretch = s[0] * of_x + s[1] * of_y + s[2] * of_z;
            Scenes::at(result + lanes * link) = Scenes::at(rest + lanes * link) +
                                                law.stiffness * stretch +
                                                law.damping * (s[3] * of_y + s[4] * of_z);
        }
    });
}

/// Take forces of links with these reserves into their extremes. `none` (L,) is 0 of scenes that
/// take part, infinite of the others.
CATENARY_FOR_TARGETS
void take_forces(std::span<const Reserve> laws, const double* reserves,
                 std::span<const double> none, double* least, double* largest) {
    with_lanes(size(none), [&](auto lanes) __attribute__((always_inline)) {
        using Scenes = SideBySide<lanes>;
        const typename Scenes::Numbers left_out = Scenes::at(none.data()), nothing{};
        for (int64_t link = 0; link < size(laws); ++link) {
            const Reserve& law = laws[link];
            const typename Scenes::Numbers reserve = Scenes::at(reserves + lanes * link);
            const auto whole = law.carried * reserve, part = whole - law.released * reserve;
            const auto force = reserve < nothing ? part : whole;
            typename Scenes::InMemory &low = Scenes::at(least + lanes * link),
                                      &high = Scenes::at(largest + lanes * link);
            const auto down = force + left_out, up = force - left_out;
            low = down < low ? down : low;
            high = up > high ? up : high;
        }
    });
}

/// Take displacements of unknowns into their largest ones, as `take_forces`.
CATENARY_FOR_TARGETS
void take_uplift(const Motion& motion, std::span<const int64_t> unknowns,
                 std::span<const double> none, double* largest) {
    with_lanes(size(none), [&](auto lanes) __attribute__((always_inline)) {
        using Scenes = SideBySide<lanes>;
        const double *x = motion.x.data(), *y = motion.y.data(), *z = motion.z.data();
        const double* s = motion.shares.data();
        const typename Scenes::Numbers left_out = Scenes::at(none.data());
        for (int64_t arm = 0; arm < size(unknowns); ++arm) {
            const int64_t at = unknowns[arm] * lanes;
            const auto up = s[0] * Scenes::at(x + at) + s[1] * Scenes::at(y + at) +
                            s[2] * Scenes::at(z + at) - left_out;
            typename Scenes::InMemory& high = Scenes::at(largest + lanes * arm);
            high = up > high ? up : high;
        }
    });
}

}  // namespace

ScenePasses::ScenePasses(PassParts parts)
    : parts_(std::move(parts)), line_(parts_, static_cast<int>(parts_.arrays.motion.spacing)) {
    if (!parts_.arrays.known.empty())
        throw std::invalid_argument("scenes side by side take steps of Newmark's method only");
}

void ScenePasses::track(const TrackedLinks& tracked, Array2<const double> rest,
                        std::vector<std::span<double>> reserves) {
    if (std::ssize(reserves) != n() || rest.columns != n())
        throw std::invalid_argument("a scene has no reserves");
    tracked_ = tracked;
    rest_ = rest;
    reserves_ = std::move(reserves);
    make_room(tracked.links.law.size());
}

void ScenePasses::make_room(size_t n_links) {
    found_.resize(std::max(found_.size(), n_links * n()));
}

void ScenePasses::step() {
    line_.line.step(line_.work, parts_.factors.at(), std::max<int64_t>(1, tracked_.stretch), *this);
}

void ScenePasses::after_stretch() {
    tracked_.behind(n_followed_++, [this](int64_t begin, int64_t end) {
        find_reserves(parts_.arrays.motion, tracked_.links, rest_.data, begin, end, found_.data());
        for (int64_t link = begin; link < end; ++link)
            for (int64_t s = 0; s < n(); ++s) reserves_[s][link] = found_[n() * link + s];
    });
}

void ScenePasses::take(const LineExtremes& extremes, std::span<const double> none) {
    const Motion& motion = parts_.arrays.motion;
    take_uplift(motion, extremes.arms, none, extremes.uplift.data);
    const auto laws = extremes.droppers.law;
    find_reserves(motion, extremes.droppers, extremes.rest.data, 0, size(laws), found_.data());
    take_forces(laws, found_.data(), none, extremes.least.data, extremes.largest.data);
}

void ScenePasses::rest(int64_t scene) const {
    if (scene < 0 || scene >= n()) throw std::out_of_range("there is no such scene");
    const PassArrays& arrays = parts_.arrays;
    auto clear = [scene, n = n()](std::span<double> numbers) {
        for (int64_t at = scene; at < size(numbers); at += n) numbers[at] = 0.0;
    };
    for (auto numbers : {arrays.factor, arrays.velocity, arrays.answer}) clear(numbers);
    for (auto numbers : {arrays.motion.x, arrays.motion.y, arrays.motion.z}) clear(numbers);
}

Ensemble::Ensemble(std::shared_ptr<ScenePasses> passes, LineExtremes extremes)
    : passes_(std::move(passes)), extremes_(std::move(extremes)) {
    if (!passes_) throw std::invalid_argument("an ensemble has no passes");
    passes_->make_room(extremes_.droppers.law.size());
    marches_.resize(passes_->n());
    none_.resize(passes_->n());
}

void Ensemble::begin(int64_t lane, std::shared_ptr<Steps> steps, int64_t n) {
    if (n < 0 || n > steps->n_steps()) throw std::out_of_range("a block has not as many steps");
    marches_.at(lane) = {std::move(steps), 0, n, false};
}

void Ensemble::take(int64_t most) {
    const FlushedSubnormals flushed;
    for (int64_t k = 0; k < most; ++k) {
        for (March& march : marches_)
            if (goes_on(march)) march.steps->set_off(march.next);
        passes_->step();
        bool all_go_on = true;
        for (size_t lane = 0; lane < marches_.size(); ++lane) {
            March& march = marches_[lane];
            none_[lane] = goes_on(march) ? 0.0 : std::numeric_limits<double>::infinity();
            if (!goes_on(march)) continue;
            march.is_left = !march.steps->arrive(march.next);
            if (!march.is_left) march.steps->show(march.next++);
            all_go_on &= goes_on(march);
        }
        passes_->take(extremes_, none_);
        if (!all_go_on) break;
    }
}

}  // namespace catenary
