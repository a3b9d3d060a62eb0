"""Control of the lift of a pantograph: a table of gains, or a controller of the user.

A controller adds a force to the static force. It sees the contact force and the head's height at
the end of each step, and what it says acts in the steps after it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from catenary.solver.kernels import native


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
