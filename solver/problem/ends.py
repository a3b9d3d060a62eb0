"""Ends of a line: held, in spans that absorb waves, or as if it went on periodically."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Fixed:
    """All wires are held in height where they end. Waves come back whole."""


@dataclass(frozen=True)
class AbsorbingLayer:
    """The last ``n_spans`` spans are damped on mass, by more the nearer the end, which is held.

    The damping per mass grows from zero as ``damping`` (x / l)^2 [1/s], x into the layer of length
    l; it acts beside that of the line.
    """

    n_spans: int
    damping: float


@dataclass(frozen=True)
class Periodic:
    """The line goes on for ever with spans like the last ones, whose droppers do not slacken.

    Waves leave, and the wires at the end move as at any other mast.
    """


EndCondition = Fixed | AbsorbingLayer | Periodic
"""How one end of a line behaves in motion. The line at rest is held there in either case."""
