"""Arrays that compiled loops walk through side by side, placed for the caches.

Memory as it comes begins anywhere in a cache line, so that four numbers may lie in two of them, and
large arrays all begin at the same place of a page, where a processor takes a number just written
for one about to be read. Either costs up to a quarter of a solve, on one rank and not on another.
"""

from __future__ import annotations

import numpy as np

LINE, PAGE = 64, 4096
# From one place of a page to the next: far enough for no two arrays to be in each other's way.
_APART = 9 * LINE


def zeros(size: int, place: int = 0) -> np.ndarray:
    """Array of ``size`` zeros that begins at a cache line, at a ``place`` of a page: 0, 1, ...

    Arrays of different place (of seven) are not in each other's way.
    """
    room = np.zeros(size + PAGE // 8)
    begin = (place * _APART - room.ctypes.data) % PAGE // 8
    return room[begin : begin + size]


def copy(numbers: np.ndarray) -> np.ndarray:
    """Copy numbers, one after the other, into an array that begins at a cache line."""
    result = zeros(numbers.size)
    result[:] = numbers.ravel()
    return result
