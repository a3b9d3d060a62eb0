#pragma once
// Subnormal numbers, which some processors take long for. See flush_to_zero.py.
#include <cstdint>

namespace catenary {

/// Let this thread take subnormal numbers for zero, operands and results, where the processor is
/// one that can be told so. What it did before, for `restore_subnormals`.
uint64_t flush_subnormals();
/// Let it do what it did before.
void restore_subnormals(uint64_t before);

}  // namespace catenary
