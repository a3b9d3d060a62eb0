"""Masts of a line: where they stand, and between which of them trains run."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np


def read_only(values: np.ndarray) -> np.ndarray:
    """An array that nothing may write into, as it is shared."""
    values.flags.writeable = False
    return values


@dataclass(frozen=True)
class Spans:
    """Spans from anchor to anchor.

    Attributes
    ----------
    span_lengths : (n_spans,) [m]
    n_transition : spans at the start and at the end in which contact wires rise to the tensioner
    """

    span_lengths: tuple[float, ...]
    n_transition: tuple[int, int]

    @property
    def n_spans(self) -> int:
        return len(self.span_lengths)

    @cached_property
    def support_positions(self) -> np.ndarray:
        """Positions of all masts, both anchors included, shape (n_spans + 1,) [m]; read-only."""
        return read_only(np.concatenate([[0.0], np.cumsum(self.span_lengths)]))

    @property
    def running_range(self) -> tuple[float, float]:
        """Where a pantograph may run: from the end of the first transition to the start of the
        last one [m]."""
        masts = self.support_positions
        return float(masts[self.n_transition[0]]), float(masts[self.n_spans - self.n_transition[1]])
