"""Part of a line that a step computes: all of it, or a window that moves with the train."""

from __future__ import annotations

from dataclasses import dataclass

OFF, EXACT, BOUNDED = "off", "exact", "bounded"
# Of motions in an exact window, in terms of the largest one: below that they are round-off.
ROUND_OFF = 1e-14


@dataclass(frozen=True)
class WindowChoice:
    """Choice of the stations that move.

    ``mode`` is ``off`` (all), ``exact`` (all that any wave has reached) or ``bounded``: those whose
    motion exceeds ``tolerance`` times the largest one of the line, or those from ``spans_behind``
    behind the last pantograph to ``spans_ahead`` ahead of the first one. ``fading`` [m2/s], over
    the square of its length, is the damping on mass with which the outer part of it ends.
    """

    mode: str = OFF
    tolerance: float | None = None
    spans_ahead: float = 0.0
    spans_behind: float = 0.0
    fading: float = 0.0

    @property
    def moves(self) -> bool:
        """Whether there is a window."""
        return self.mode != OFF

    @property
    def by_motion(self) -> float:
        """Share of the largest motion above which stations move, 0 if spans decide."""
        if self.mode == EXACT:
            return ROUND_OFF
        return self.tolerance or 0.0
