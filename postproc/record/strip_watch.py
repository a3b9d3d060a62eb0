"""Warns once for each pantograph when a contact wire leaves its strips under way."""

from __future__ import annotations

import logging
from collections.abc import Sequence

import numpy as np

from catenary.solver.time_loop.views.observers import NEVER, Observer, Stage, StepView

logger = logging.getLogger("catenary.strips")


class StripWatch(Observer):
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

    def next_state(self, step: int) -> int:
        """Rows are enough."""
        return NEVER

    def observe(self, view: StepView) -> None:
        """Check steps."""
        places = view.each("lateral_place")
        if not places.shape[1]:
            return  # on another rank
        for p, (half, own) in enumerate(zip(self._half_lengths, self._contacts, strict=True)):
            if self._warned[p]:
                continue
            beyond = (np.abs(places[:, own]) > half).any(axis=1)
            if beyond.any():
                self._warned[p] = True
                row = int(np.argmax(beyond))
                x = view.each("contact_position")[row, p]
                logger.warning(
                    "a contact wire leaves the strips of pantograph %d at %.4g s, %.4g m: they end "
                    "%.3g m beside their middle; contact goes on as if it stayed on them",
                    p + 1,
                    view.times[row],
                    x,
                    half,
                )
