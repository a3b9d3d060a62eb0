"""Where elimination from both ends meets: factors for every such station, and how it moves."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from catenary.solver.kernels import native

# Where elimination may end at several places, it may at every so many stations.
MIDDLES = native.MIDDLES
# Sum of the eigenvalues of S^-1 A - 1 where steps of a part of the line may end.
_SOFTENED = 1.0


class Turning(NamedTuple):
    """Kinds of stations by where elimination ends: ``to_end`` (n,) where that is further on,
    ``to_start`` (n,) where it is before, ``here`` (m,) for each station at which it may end, one of
    ``MIDDLES``. Steps may be taken of a part of the stations: from those in ``begins`` (n + 1,) to
    before those in ``ends`` (n + 1,), which are the next ones outwards of each; see ``edges``."""

    to_end: np.ndarray
    to_start: np.ndarray
    here: np.ndarray
    begins: np.ndarray
    ends: np.ndarray

    def place(self, low: int, high: int) -> int:
        """A station where it may end, near the middle from ``low`` to ``high``."""
        return int(native.middle_of(low, high))


def softened(whole: np.ndarray, eliminated: np.ndarray) -> np.ndarray:
    """Whether steps of a part of the line may end at stations (k,).

    What is beyond is held, but the factors let it give way by its mass and stiffness D. That leaves
    M + tau C - D in place of M + tau C there, which must not become negative: it does where
    elements are so short that the step operator A is mostly stiffness. D is what A has more than
    the block S after elimination; all eigenvalues of S^-1 A are to be below 2.

    ``whole`` (k, b, b) and ``eliminated`` (k, b, b) are A and S^-1 of each.
    """
    traces = np.einsum("kij,kji->k", eliminated, whole)
    return np.asarray(traces - whole.shape[1] < _SOFTENED)


def edges(towards_end: np.ndarray, towards_start: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where steps of a part of the line may begin and end, from each station outwards, (n + 1,).

    ``towards_end`` and ``towards_start`` (n,) are what ``softened`` says of each station after
    elimination to either side.
    """
    n = towards_end.size
    number = np.arange(n + 1)
    can_begin = np.append(towards_end, True)
    can_end = np.append(True, towards_start)
    can_begin[0] = can_end[n] = True
    begins = np.maximum.accumulate(np.where(can_begin, number, 0))
    ends = np.minimum.accumulate(np.where(can_end, number, n)[::-1])[::-1]
    return begins, ends
