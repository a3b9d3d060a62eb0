"""Defects of a line: what is wrong once its droppers are cut.

Data only. Droppers keep the lengths to which they were cut for the sound line.
"""

from __future__ import annotations

from dataclasses import dataclass

from catenary.meshgen.line import DropperPlace


@dataclass(frozen=True)
class MissingDropper:
    """The dropper at a place is not there, nor are its clamps."""

    place: DropperPlace


@dataclass(frozen=True)
class LooseClamp:
    """A clamp of the dropper at a place slips: it carries nothing; all masses stay."""

    place: DropperPlace


@dataclass(frozen=True)
class WornWire:
    """A ``wire`` that has lost the share ``lost`` of its section from ``start`` to ``end`` [m].

    It is worn flat from below, and keeps its tension.
    """

    wire: str
    start: float
    end: float
    lost: float


@dataclass(frozen=True)
class WrongTension:
    """A ``wire`` that hangs with ``factor`` times the tension that its droppers were cut for."""

    wire: str
    factor: float


@dataclass(frozen=True)
class HardSpot:
    """A lumped ``mass`` [kg] on a ``wire`` at ``x`` [m], and a spring there to the ground.

    ``stiffness`` [N/m] of the spring, which carries nothing at rest.
    """

    wire: str
    x: float
    mass: float
    stiffness: float


@dataclass(frozen=True)
class Kink:
    """A ``wire`` that is bent for good at ``x`` [m] by ``angle`` [rad].

    A positive angle raises the slope dz/dx along the track: the bend points down.
    """

    wire: str
    x: float
    angle: float


Defect = MissingDropper | LooseClamp | WornWire | WrongTension | HardSpot | Kink
