// A chain of lumped masses on linear springs and dampers.
#include "heads/linear_chain.hpp"

#include <stdexcept>

namespace catenary {

LinearChain::LinearChain(const HeadArrays& arrays, const LinearStep& linear)
    : Head(arrays), linear_(linear) {
    const int64_t n = this->n();
    if (linear.matrix.rows != 3 * n || linear.matrix.columns != 3 * n ||
        size(linear.by_drive) != 3 * n || size(linear.by_head) != 3 * n ||
        linear.inverse.rows != n || linear.inverse.columns != n)
        throw std::invalid_argument("a linear step has other coordinates than its head");
}

bool LinearChain::step_free(const Drive& drive) {
    const auto now = state();
    const auto after = free();
    const double lift = drive.force + added(drive);
    for (int64_t i = 0; i < size(now); ++i) {
        double value = lift * linear_.by_drive[i] + drive.head_air * linear_.by_head[i];
        const auto row = linear_.matrix[i];
        for (int64_t k = 0; k < size(now); ++k) value += row[k] * now[k];
        after[i] = value;
    }
    respond(linear_.inverse);
    return true;
}

}  // namespace catenary
