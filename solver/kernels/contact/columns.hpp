#pragma once
// Sums of columns of A^-1, the influence functions of unit forces, which vanish outside of windows.
#include "base/arrays.hpp"
#include "contact/touch.hpp"
#include "motion/motion.hpp"

namespace catenary {

/// Make the numbers from `low` to `high` zero, if there are any.
void clear(std::span<double> answer, int64_t low, int64_t high);

/// Put the weighted sum of the columns of two neighbouring nodes, two of each, into `answer`, zero
/// elsewhere. `filled` is the range outside of which it is zero, before and after the call.
void put_columns(const Node* nodes, std::span<const double> data, const double (&weights)[4],
                 std::span<double> answer, int64_t (&filled)[2]);

/// Add the answer to a force [N], of the unknowns from `begin` on, to the motion.
void add_answer(double force, std::span<const double> answer, int64_t begin, const Motion& motion,
                std::span<const double> gains);

}  // namespace catenary
