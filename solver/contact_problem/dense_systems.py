"""Small dense systems, of which some rows and columns act, as kernels take them; see
``kernels/contact_problem/active_set.hpp``."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class System(NamedTuple):
    """matrix x = right of m unknowns, the length of ``right``; the matrix may have more of both."""

    matrix: np.ndarray
    right: np.ndarray
    solution: np.ndarray


class Signs(NamedTuple):
    """Of m unknowns: which may have any sign, ``always``; of a rider's how many rows its master's
    is before it, which it acts with, 0 of others, ``behind``."""

    always: np.ndarray
    behind: np.ndarray


class Room(NamedTuple):
    """Room to solve for up to k unknowns: ``factors`` (k, k), the others (k,)."""

    factors: np.ndarray
    acting: np.ndarray
    order: np.ndarray
    left: np.ndarray
    change: np.ndarray
    acts: np.ndarray


def room_for(k: int) -> Room:
    """Room to solve for up to k unknowns."""
    acting, order = np.zeros((2, k), dtype=np.int64)
    left, change = np.zeros((2, k))
    return Room(np.zeros((k, k)), acting, order, left, change, np.zeros(k, dtype=bool))
