// Steps of all lanes, each as far as its scene goes.
#include "ensemble/ensemble.hpp"

#include <limits>
#include <stdexcept>

#include "base/flush_to_zero.hpp"

namespace catenary {

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
