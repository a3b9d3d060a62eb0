"""Recorded part of the line's channels: cadence, window, stretch, names, compression."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from catenary.solver.time_loop.views import channels

NONE, GZIP = "none", "gzip"
# Level 4 was not smaller than level 1 on the forces of droppers, and slower.
GZIP_LEVEL = 1


@dataclass(frozen=True)
class LineRecord:
    """Recorded part of the channels with a column for each arm, dropper or wire end.

    Attributes
    ----------
    every : steps between two rows
    window : how far behind the last and ahead of the first pantograph columns are recorded [m],
        None for the whole line; what is outside is NaN
    stretch : from and to of the columns that are recorded [m], None for all
    names : channels that are recorded
    compression : ``NONE`` or ``GZIP``
    by_size : whether cadence, window and compression follow from the size of the whole record
    """

    every: int = 1
    window: tuple[float, float] | None = None
    stretch: tuple[float, float] | None = None
    names: tuple[str, ...] = field(default_factory=channels.line_channels)
    compression: str = NONE
    by_size: bool = False

    @property
    def whole(self) -> bool:
        """Whether every channel is recorded at every step on the whole line."""
        return (
            self.every == 1
            and self.window is None
            and self.stretch is None
            and set(self.names) >= set(channels.line_channels_of_all())
        )

    def of(self, train: channels.TrainLayout) -> LineRecord:
        """Return this record for a run with this train, which may lack some of the channels."""
        there = channels.line_channels(train)
        return replace(self, names=tuple(name for name in self.names if name in there))

    def columns(self, x: np.ndarray) -> np.ndarray:
        """Indices of the columns at positions ``x`` [m] that are recorded, ascending."""
        if self.stretch is None:
            return np.arange(x.size)
        low, high = self.stretch
        return np.flatnonzero((x >= low - 1e-6) & (x <= high + 1e-6))

    def within(self, position: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
        """From and to of the window at each row, (rows,) each [m]; None without a window.

        Parameters
        ----------
        position : ndarray, shape (rows, n_pantographs)
            Places of the pantographs along the track [m].
        """
        if self.window is None:
            return None
        behind, ahead = self.window
        return position.min(axis=1) - behind, position.max(axis=1) + ahead

    def as_table(self) -> dict[str, Any]:
        """Plain values for the result file; ``from_table`` gives the record again."""
        return {
            "every_steps": self.every,
            "window_m": self.window,
            "stretch_m": self.stretch,
            "channels": list(self.names),
            "compression": self.compression,
            "by_size": self.by_size,
        }


def from_table(table: Mapping[str, Any]) -> LineRecord:
    """The record that ``LineRecord.as_table`` described."""
    window, stretch = table["window_m"], table["stretch_m"]
    return LineRecord(
        int(table["every_steps"]),
        None if window is None else (float(window[0]), float(window[1])),
        None if stretch is None else (float(stretch[0]), float(stretch[1])),
        tuple(table["channels"]),
        str(table["compression"]),
        bool(table["by_size"]),
    )


def record_words(record: LineRecord, dt: float) -> str:
    """Recorded part, in words, at a time step of ``dt`` [s]."""
    if not record.names:
        return "not recorded; extremes are kept of every step"
    if record.whole:
        words = "recorded at every step"
    else:
        every = "at every step" if record.every == 1 else f"every {1e3 * record.every * dt:g} ms"
        words = f"recorded {every}"
        if record.window is not None:
            behind, ahead = record.window
            words += f" within {behind:g} m behind and {ahead:g} m ahead of the train"
        if record.stretch is not None:
            words += f" from {record.stretch[0]:g} to {record.stretch[1]:g} m"
        if not set(record.names) >= set(channels.line_channels_of_all()):
            words = f"of these {', '.join(record.names)} {words}"
        words += "; extremes are kept of every step"
    if record.compression != NONE:
        words += "; compressed"
    return words + (" (chosen by size)" if record.by_size else "")
