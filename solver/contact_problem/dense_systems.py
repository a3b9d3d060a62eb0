"""Small dense systems, of which some rows and columns act, as kernels take them; see
``active_set.hpp`` and ``room.hpp`` of ``kernels/contact_problem``."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class System(NamedTuple):
    """matrix x = right of m unknowns, the length of ``right``; the matrix may have more of both."""

    matrix: np.ndarray
    right: np.ndarray
    solution: np.ndarray


class Signs(NamedTuple):
    """Of m unknowns: which may have any sign, ``always``; of a dependent's how many rows its
    leader's is before it, which it acts with, 0 of others, ``behind``."""

    always: np.ndarray
    behind: np.ndarray


class PathRoom(NamedTuple):
    """Room for a path of simplices in up to n dimensions: ``columns`` (n + 1, n + 1), ``numbers``
    (7, n + 1), ``counts`` (4, n + 1), ``all`` (n + 1,)."""

    columns: np.ndarray
    numbers: np.ndarray
    counts: np.ndarray
    all: np.ndarray


class PivotRoom(NamedTuple):
    """Room to pivot with up to k unknowns: ``needs``, ``excludes`` and ``partly`` (k, k),
    ``turned`` (20 k + 100,), ``numbers`` (4, k), ``counts`` (2, k), ``marks`` (3, k), ``path`` in
    k / 2 dimensions."""

    needs: np.ndarray
    excludes: np.ndarray
    turned: np.ndarray
    partly: np.ndarray
    numbers: np.ndarray
    counts: np.ndarray
    marks: np.ndarray
    path: PathRoom


class Room(NamedTuple):
    """Room to solve for up to k unknowns: ``factors`` (k, k), ``pivoting``, the others (k,)."""

    factors: np.ndarray
    acting: np.ndarray
    order: np.ndarray
    left: np.ndarray
    change: np.ndarray
    acts: np.ndarray
    before: np.ndarray
    pivoting: PivotRoom


def room_for(k: int) -> Room:
    """Room to solve for up to k unknowns."""
    acting, order = np.zeros((2, k), dtype=np.int64)
    left, change = np.zeros((2, k))
    acts, before = np.zeros((2, k), dtype=bool)
    n = k // 2 + 1
    counts = np.zeros((4, n), dtype=np.int64)
    path = PathRoom(np.zeros((n, n)), np.zeros((7, n)), counts, np.zeros(n, dtype=bool))
    needs, excludes = np.zeros((2, k, k), dtype=bool)
    pivoting = PivotRoom(
        needs,
        excludes,
        turned=np.zeros(20 * k + 100, dtype=np.int64),
        partly=np.zeros((k, k)),
        numbers=np.zeros((4, k)),
        counts=np.zeros((2, k), dtype=np.int64),
        marks=np.zeros((3, k), dtype=bool),
        path=path,
    )
    return Room(np.zeros((k, k)), acting, order, left, change, acts, before, pivoting)
