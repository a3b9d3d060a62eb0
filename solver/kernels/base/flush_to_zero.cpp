// The control register of a thread's floating point arithmetic.
#include "base/flush_to_zero.hpp"

#if defined(__x86_64__)
#include <xmmintrin.h>
#endif

namespace catenary {

namespace {

#if defined(__x86_64__)
// In the control register of SSE: results that are subnormal, and operands that are.
constexpr uint64_t kTakenForZero = 0x8000 | 0x0040;

uint64_t control() {
    return _mm_getcsr();
}
void set_control(uint64_t value) {
    _mm_setcsr(static_cast<unsigned>(value));
}
#elif defined(__aarch64__)
constexpr uint64_t kTakenForZero = uint64_t{1} << 24;  // both

uint64_t control() {
    uint64_t value;
    asm volatile("mrs %0, fpcr" : "=r"(value));
    return value;
}
void set_control(uint64_t value) {
    asm volatile("msr fpcr, %0" : : "r"(value) : "memory");
}
#else
constexpr uint64_t kTakenForZero = 0;

uint64_t control() {
    return 0;
}
void set_control(uint64_t) {}
#endif

}  // namespace

uint64_t flush_subnormals() {
    const uint64_t before = control();
    set_control(before | kTakenForZero);
    return before;
}

void restore_subnormals(uint64_t before) {
    set_control(before);
}

}  // namespace catenary
