#pragma once
// Subnormal numbers, on which some processors are slow. See flush_to_zero.py.
#include <cstdint>

namespace catenary {

/// Flush subnormal numbers to zero in this thread, operands and results, where the processor can.
/// Returns the mode before, for `restore_subnormals`.
uint64_t flush_subnormals();
/// Restore the mode before.
void restore_subnormals(uint64_t before);

/// Flushes them as long as it lives.
class FlushedSubnormals {
  public:
    ~FlushedSubnormals() { restore_subnormals(before_); }

  private:
    uint64_t before_ = flush_subnormals();
};

}  // namespace catenary
