"""Defects and incidents of a line: what is wrong once its droppers are cut, or happens in a run.

Data only. With defects droppers keep the lengths to which they were cut for the sound line. Of
incidents `after_incidents` changes the line, and `march` decides when. What may happen to a
pantograph stands with its placement (`mbs.lowering`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field


@dataclass(frozen=True)
class MissingDropper:
    """The dropper at ``x`` [m] is not there, nor are its clamps."""

    x: float


@dataclass(frozen=True)
class LooseClamp:
    """A clamp of the dropper at ``x`` [m] slips: it carries nothing; all masses stay."""

    x: float


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


@dataclass(frozen=True)
class DropperBreak:
    """From ``time`` [s] on the dropper at ``x`` [m] carries nothing."""

    time: float
    x: float


@dataclass(frozen=True)
class TensionLoss:
    """From ``time`` [s] on a ``wire`` has only the ``share`` of its first tension.

    ``wire`` is the name of a wire of the line.
    """

    time: float
    wire: str
    share: float


LineIncident = DropperBreak | TensionLoss


@dataclass(frozen=True)
class Happened:
    """Incidents of a line up to the end of step ``step``, in order of time."""

    step: int
    incidents: tuple[LineIncident, ...] = field(default=())


def in_steps(incidents: Sequence[LineIncident], dt: float) -> list[Happened]:
    """Incidents up to the end of each step in which one happens, by ascending step.

    Times are rounded to the nearest end of a step of ``dt`` [s].
    """
    ordered = sorted(incidents, key=lambda incident: incident.time)
    steps = [round(incident.time / dt) for incident in ordered]
    return [
        Happened(step, tuple(ordered[: len(ordered) - steps[::-1].index(step)]))
        for step in sorted(set(steps))
    ]
