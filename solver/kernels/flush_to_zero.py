"""Flush subnormal floats to zero during the time loop (FTZ and DAZ bits of x86, FZ of ARM).

The response of an implicit step decays along the line to below 1e-308 m. Arithmetic on such
subnormal numbers is slow on some x86 processors: half of the march of a hundred spans.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from catenary.solver.kernels import native


@contextmanager
def flushed() -> Iterator[None]:
    """Within it this thread takes subnormal numbers for zero, where that is faster.

    A context manager. Not collective.
    """
    for kind in (np.float32, np.float64):
        np.finfo(kind)  # whose first call warns here
    before = native.flush_subnormals()
    try:
        yield
    finally:
        native.restore_subnormals(before)
