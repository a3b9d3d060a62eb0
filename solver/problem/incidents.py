"""Incidents of a line: what happens to it in a run.

Data only. `after_incidents` changes the line, and `march` decides when. What may happen to a
pantograph stands with its placement (`mbs.lowering`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from catenary.meshgen.line import DropperPlace


@dataclass(frozen=True)
class DropperBreak:
    """From ``time`` [s] on the dropper at a place carries nothing."""

    time: float
    place: DropperPlace


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
