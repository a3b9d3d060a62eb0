"""Warns once for each pantograph when a contact wire leaves its strips under way."""

from __future__ import annotations

import logging
import sys
from collections.abc import Sequence

import numpy as np

from catenary.solver.time_loop.views.observers import Stage, StepView

logger = logging.getLogger("catenary.strips")


class StripWatch:
    """Observer of lateral places of contact wires. Not collective; rank 0 sees them.

    Parameters
    ----------
    half_lengths : of the strips of each pantograph [m], NaN or infinite if it is not known
    """

    def __init__(self, half_lengths: Sequence[float]) -> None:
        self._half_lengths = half_lengths

    def start(self, stage: Stage) -> None:
        """Begin to watch a march."""
        ends = stage.n_wires * np.cumsum([0, *stage.train.n_strips])
        self._contacts = [slice(*pair) for pair in zip(ends[:-1], ends[1:], strict=True)]
        self._warned = [False] * stage.n_pantographs
        self._columns: dict[str, slice] = {}

    def observe(self, view: StepView) -> None:
        """Check a step."""
        self._columns = view.columns
        self._check(np.array([view.time]), view.row[None])

    def next_state(self, step: int) -> int:
        """Rows are enough, once the first step has shown where they have what."""
        return sys.maxsize if self._columns else step + 1

    def observe_rows(self, first_step: int, times: np.ndarray, rows: np.ndarray) -> None:
        """Check steps of which only rows are left."""
        self._check(times, rows)

    def finish(self, outcome: str) -> None:
        """Nothing."""

    def _check(self, times: np.ndarray, rows: np.ndarray) -> None:
        places = rows[:, self._columns["lateral_place"]]
        if not places.shape[1]:
            return  # on another rank
        for p, (half, own) in enumerate(zip(self._half_lengths, self._contacts, strict=True)):
            if self._warned[p]:
                continue
            beyond = (np.abs(places[:, own]) > half).any(axis=1)
            if beyond.any():
                self._warned[p] = True
                row = int(np.argmax(beyond))
                x = rows[row, self._columns["contact_position"]][p]
                logger.warning(
                    "a contact wire leaves the strips of pantograph %d at %.4g s, %.4g m: they end "
                    "%.3g m beside their middle; contact goes on as if it stayed on them",
                    p + 1,
                    times[row],
                    x,
                    half,
                )
