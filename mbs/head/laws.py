"""Laws of a pantograph: forces over heights or velocities as tables, and the control of its lift.

A law acts between a mass and what is below it, or between a mass and the base. It pulls the mass
down, and what is below it up, by a force over the extension between the two, or over its rate.

Control is by a table of gains, or by a controller of the user. A controller adds a force to the
static force. It sees the contact force and the head's height at the end of each step, and what it
says acts in the steps after it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from catenary.solver.kernels import native


@dataclass(frozen=True)
class Law:
    """A force over an extension, straight between its points and beyond its ends.

    Extensions between two masses count from where all springs are relaxed. Those between a mass and
    the base count from where the mass stands with the head at its nominal height under the static
    force, where the base spring of a chain is relaxed.

    Attributes
    ----------
    mass : which mass it holds, the head being 0
    below : which one it holds it to; the number of masses stands for the base
    of_rate : whether its points are rates
    points : extensions [m] or their rates [m/s], which grow
    forces : [N] at these, which never fall
    of_roof : whether it holds to the roof, as a stop does: the base of a chain that is tied to it
        rises with the lift, the roof below does not
    """

    mass: int
    below: int
    of_rate: bool
    points: tuple[float, ...]
    forces: tuple[float, ...]
    of_roof: bool = False

    def force(self, x: float) -> float:
        """Force at ``x``, an extension [m] or a rate [m/s], that pulls together where it is
        positive [N]."""
        i = int(np.searchsorted(self.points, x, side="right")) - 1
        i = min(max(i, 0), len(self.points) - 2)
        slope = (self.forces[i + 1] - self.forces[i]) / (self.points[i + 1] - self.points[i])
        return self.forces[i] + slope * (x - self.points[i])

    @property
    def stiffness(self) -> float:
        """Its slope where it counts from, the steeper one if it has a kink there."""
        slopes = np.diff(self.forces) / np.diff(self.points)
        around = [np.searchsorted(self.points, 0.0, side=side) - 1 for side in ("left", "right")]
        return float(slopes[np.clip(around, 0, slopes.size - 1)].max())


def given_way(force: float, stiffness: float, laws: Sequence[Law], mass: int) -> float:
    """How far what is between a mass and the next one gives way under a force [m].

    Parameters
    ----------
    force : float
        Force at rest that presses the two together [N].
    stiffness : float
        Of the spring between them [N/m].
    laws : sequence of Law
        Laws of the pantograph; those over the extension between the two act beside the spring.
    mass : int
        The upper one, the head being 0.
    """
    beside = [law for law in laws if (law.mass, law.below) == (mass, mass + 1) and not law.of_rate]
    if not beside:
        return force / stiffness
    kinks = np.unique([-point for law in beside for point in law.points])
    ways = np.concatenate([[kinks[0] - 1.0], kinks, [kinks[-1] + 1.0]])
    pushes = [stiffness * way - sum(law.force(-way) for law in beside) for way in ways.tolist()]
    i = min(max(int(np.searchsorted(pushes, force)) - 1, 0), len(pushes) - 2)
    part = (force - pushes[i]) / (pushes[i + 1] - pushes[i])
    return float(ways[i] + part * (ways[i + 1] - ways[i]))


def in_place(
    laws: Sequence[Law],
    numbers: Sequence[int],
    n: int,
    rest: Sequence[float] | np.ndarray,
    n_contacts: int,
) -> native.HeadLaws:
    """Laws on n coordinates, as kernels take them.

    Parameters
    ----------
    laws : sequence of Law
        Laws of the pantograph.
    numbers : sequence of int
        Coordinates of its masses.
    n : int
        Number of all coordinates.
    rest : sequence of float
        Heights of the masses at rest under the static force, at the nominal height [m].
    n_contacts : int
        For so many contacts there is room for the latest forces.
    """
    ways, law = np.zeros((len(laws), n)), np.zeros(len(laws), dtype=native.HEAD_LAW)
    law["of_rate"] = [one.of_rate for one in laws]
    law["end"] = np.cumsum([len(one.points) for one in laws])
    law["begin"][1:] = law["end"][:-1]
    for j, one in enumerate(laws):
        ways[j, numbers[one.mass]] = 1.0
        if one.below < len(numbers):
            ways[j, numbers[one.below]] = -1.0
        else:
            law["by_roof" if one.of_roof else "by_base"][j] = -1.0
            law["zero"][j] = rest[one.mass]
    points = [pair for one in laws for pair in zip(one.points, one.forces, strict=True)]
    return native.HeadLaws(
        ways, law, np.array(points, dtype=native.HEAD_LAW_POINT), np.zeros(n_contacts)
    )


@dataclass(frozen=True)
class Regulation:
    """A PID controller of sampled values, with scheduled gains.

    Attributes
    ----------
    of_height : whether it holds the head's height, else the contact force
    target : wanted height [m] or force [N]
    gains : rows of a measured value [m] or [N] and the gains of the error, of its integral over
        time, and of its rate there; straight in between, constant beyond the ends
    least, most : added force [N]
    sample_time : between samples [s]; the force is held in between
    filter_time : time constant of a filter of first order before the samples [s], 0 without
    delay : of the added force [s], a whole number of samples
    from_time : of the first sample [s]
    """

    of_height: bool
    target: float
    gains: tuple[tuple[float, float, float, float], ...]
    least: float
    most: float
    sample_time: float
    filter_time: float = 0.0
    delay: float = 0.0
    from_time: float = 0.0

    def arrays(self, dt: float) -> native.Regulation:
        """The controller before its first step, for steps of ``dt`` [s] from time 0 on."""
        settings = np.zeros(1, dtype=native.REGULATION)
        settings["of_height"], settings["target"] = self.of_height, self.target
        settings["part"], settings["dt"] = 1.0, dt
        if self.filter_time > 0.0:
            settings["part"] = -math.expm1(-dt / self.filter_time)
        settings["sample"] = self.sample_time
        settings["least"], settings["most"] = self.least, self.most
        gains = np.array(list(self.gains), dtype=native.CONTROL_GAINS)
        memory = np.zeros(1, dtype=native.REGULATION_MEMORY)
        memory["next"], memory["samples"] = self.from_time, -1.0
        return native.Regulation(
            settings, gains, memory, np.zeros(round(self.delay / self.sample_time))
        )


class Controller(Protocol):
    """A controller of one's own, for programs that make problems in Python.

    It lives on rank 0. A scene cannot name one: a scene holds data only.
    """

    def added_force(self, time: float, contact_force: float, head_height: float) -> float:
        """Force that is added to the static force after ``time`` [s], the end of a step [N].

        Called once a step, with the sum of the contact forces [N] and the mean height of the
        strips [m].
        """

    def state(self) -> np.ndarray:
        """Memory of the controller, as one array of a fixed shape."""

    def restore(self, state: np.ndarray) -> None:
        """Continue from what ``state`` returned."""


# Regulation of a pantograph: data, or a function that makes a controller for a run.
Regulator = Regulation | Callable[[], Controller]
