"""Flush subnormal floats to zero during the time loop (FTZ and DAZ bits of x86).

The response of an implicit step decays along the line to below 1e-308 m. Arithmetic on such
subnormal numbers is slow on some x86 processors: half of the march of a hundred spans.
"""

from __future__ import annotations

import platform
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from catenary.solver.base.kernels.compiled import compiled

# The bits below are those of this family only.
_UNDERSTOOD = platform.machine().lower() in ("x86_64", "amd64")
# In the control register of SSE: results that are subnormal, and operands that are.
_TAKEN_FOR_ZERO = 0x8000 | 0x0040
_ALL = 0xFFFFFFFF
_inlined: Any = intrinsic


@_inlined
def _exchanged(typing_context, kept, added):
    """Change this thread's control register of SSE: keep some bits, add others; what it was."""

    def generate(context, builder, signature, arguments):
        pointer = ir.IntType(8).as_pointer()
        moving = ir.FunctionType(ir.VoidType(), [pointer])
        read, write = (
            builder.module.declare_intrinsic(f"llvm.x86.sse.{name}", (), moving)
            for name in ("stmxcsr", "ldmxcsr")
        )
        place = cgutils.alloca_once(builder, ir.IntType(32))
        address = builder.bitcast(place, pointer)
        builder.call(read, [address])
        before = builder.load(place)
        kept, added = arguments
        builder.store(builder.or_(builder.and_(before, kept), added), place)
        builder.call(write, [address])
        return before

    return types.uint32(types.uint32, types.uint32), generate


@compiled
def _exchange(kept, added):
    return _exchanged(kept, added)


@contextmanager
def flushed() -> Iterator[None]:
    """Within it this thread takes subnormal numbers for zero, where that is faster.

    A context manager. Not collective.
    """
    # With NUMBA_DISABLE_JIT there is no intrinsic.
    if not (_UNDERSTOOD and hasattr(_exchange, "overloads")):
        yield
        return
    for kind in (np.float32, np.float64):
        np.finfo(kind)  # whose first call warns here
    before = _exchange(_ALL, _TAKEN_FOR_ZERO)
    try:
        yield
    finally:
        _exchange(0, before)
