#pragma once
// Subnormal numbers, which some processors take long for. See flush_to_zero.py.
#include <cstdint>

namespace catenary {

/// Let this thread take subnormal numbers for zero, operands and results, where the processor can.
/// Returns the mode before, for `restore_subnormals`.
uint64_t flush_subnormals();
/// Restore the mode before.
void restore_subnormals(uint64_t before);

}  // namespace catenary
