"""Ends of a line and of its wires: held, absorbing, periodic; tensioners, mid-point anchors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from catenary.meshgen.wires import Conductor


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


@dataclass(frozen=True)
class Tensioner:
    """Weights on a wheel that pull at the end of a wire, each wire with its own.

    Attributes
    ----------
    ratio : travel of the weights over that of the wire
    efficiency : share of the weights' pull that arrives when they sink or rise; with less than 1
        the wheel does not turn while the tension T is between r W eta and r W / eta
    travel : how far the end of the wire may move either way from the installation [m], None if
        nothing stops it
    stop_stiffness : of what stops it [N/m]
    weights : masses by name of the wire [kg]; those of others fit their tensions
    """

    ratio: float = 3.0
    efficiency: float = 1.0
    travel: float | None = None
    stop_stiffness: float = 1e6
    weights: Mapping[str, float] = field(default_factory=dict)

    @property
    def turns(self) -> bool:
        """Whether it moves under any change of tension: nothing rubs."""
        return self.efficiency == 1.0

    def mass(self, name: str, wire: Conductor, gravity: float) -> float:
        """Mass of the weights of the wire ``name`` at ``gravity`` [m/s2] [kg]."""
        return self.weights.get(name, wire.tension / (self.ratio * gravity))

    def inertia(self, name: str, wire: Conductor, gravity: float) -> float:
        """Inertia of the weights at the end of the wire, ``ratio``^2 times their mass [kg]."""
        return self.ratio**2 * self.mass(name, wire, gravity)

    def band(self, name: str, wire: Conductor, gravity: float) -> tuple[float, float]:
        """Tensions between which the wheel does not turn, r W eta and r W / eta [N]."""
        pull = self.ratio * gravity * self.mass(name, wire, gravity)
        return self.efficiency * pull, pull / self.efficiency


@dataclass(frozen=True)
class AlongTrack:
    """Ends of wires along the track, and their fixings in between.

    Attributes
    ----------
    tensioner : of all ends that have one
    start, end, overlap : whether wires have tensioners where the line starts, where it ends, and
        where sections end inside an overlap; they are held there if not
    mid_points : places of masts at which wires are held [m]
    warmer : temperature less that of the installation [K]
    """

    tensioner: Tensioner = Tensioner()
    start: bool = False
    end: bool = False
    overlap: bool = True
    mid_points: tuple[float, ...] = ()
    warmer: float = 0.0

    def tensioned(self, x: float, line_ends: tuple[float, float], close: float) -> bool:
        """Whether wires that end at ``x`` [m] have a tensioner there.

        ``line_ends`` are start and end of the line [m]; places nearer than ``close`` [m] are one.
        """
        at_start, at_end = (abs(x - end) < close for end in line_ends)
        if at_start:
            return self.start
        return self.end if at_end else self.overlap
