"""What the coupling asks of a pantograph, whatever its model: lumped masses or a multibody system.

Heights are measured like the line's, z up [m]; contact forces are >= 0 in compression and push
the head down. A pantograph lives on rank 0 and is never called elsewhere.
"""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np


class HeadState(NamedTuple):
    """Head at the end of the coming step as an affine function of the contact force f [N] in it.

    height = ``height`` - ``height_compliance`` f [m], velocity = ``velocity`` -
    ``velocity_compliance`` f [m/s].
    """

    height: float
    velocity: float
    height_compliance: float
    velocity_compliance: float


class Pantograph(Protocol):
    """A pantograph that advances with the global contact step."""

    def place(self, head_height: float) -> None:
        """Put the pantograph at rest with its head at this height [m], without contact."""

    def predict(self, time: float) -> HeadState:
        """Head at ``time`` [s], the end of the coming step, as a function of the force in it."""

    def advance(self, contact_force: float) -> None:
        """Take the step predicted last with this contact force [N]."""

    def state(self) -> np.ndarray:
        """Everything needed to continue, as one array."""

    def restore(self, state: np.ndarray) -> None:
        """Continue from what ``state`` returned."""

    def energy(self) -> float:
        """Kinetic and elastic energy relative to the springs at rest [J]."""
