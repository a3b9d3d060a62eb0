"""A pantograph that is lowered under way: its lift's course, and what catches it.

The part of the lift that acts goes over to another one by half a cosine, as it does while a
pantograph is raised; a negative part pulls down. Models have no housing of their own: once the head
has gone down by a stated way it is caught. Its speed relative to the base falls to zero at once,
and it moves with the base.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from catenary.mbs.head.newmark_head import raised
from catenary.mbs.interface import HeadState, Pantograph
from catenary.mbs.vehicle.base_motion import BaseMotion


@dataclass(frozen=True)
class Lowering:
    """How a pantograph is lowered from ``time`` [s] on.

    The static force goes over to ``force`` [N] over ``within`` [s]; the head is caught ``drop``
    [m] below where it was at ``time``.
    """

    time: float
    force: float
    within: float
    drop: float

    def course(self, static_force: float, raise_time: float) -> Callable[[float], float]:
        """Part of the lift that acts, as a function of time, after a raising."""
        before = raised(self.time, raise_time)
        last = self.force / static_force

        def part(time: float) -> float:
            if time <= self.time:
                return raised(time, raise_time)
            return before + (last - before) * raised(time - self.time, self.within)

        return part


class LoweredPantograph:
    """Any pantograph, lowered and caught.

    Parameters
    ----------
    model : the pantograph, whose lift follows the lowering already
    lowering : Lowering
    base : how the vehicle moves what catches the head; without it that stays
    """

    def __init__(
        self, model: Pantograph, lowering: Lowering, base: BaseMotion | None = None
    ) -> None:
        s = len(model.strip_offsets)
        self.model = model
        self._lowering, self._base = lowering, base
        # Of the strips' mean over the base: now, and where it is caught, None before.
        self._height = 0.0
        self._catch: float | None = None
        self._caught = False
        self._latest: HeadState | None = None
        self._time = 0.0
        self._still = HeadState(s)

    @property
    def strip_offsets(self) -> tuple[float, ...]:
        """Places of the strips ahead of the pantograph's own place [m]."""
        return self.model.strip_offsets

    def place(self, head_height: float, velocity: float = 0.0) -> None:
        """Put the model without contact to where its head is at this height [m]."""
        self.model.place(head_height, velocity)
        self._height = head_height - self._base_at(0.0)[0]

    def extrapolate(self, time: float) -> tuple[np.ndarray, np.ndarray]:
        """Heights and velocities (s,) of the strips at ``time`` [s] from the motion alone."""
        if not self._caught:
            return self.model.extrapolate(time)
        still = self._where_caught(time)
        return still.height, still.velocity

    def predict(self, time: float) -> HeadState:
        """Strips at ``time`` [s] as functions of the contact forces in the coming step.

        Forces do not move what is caught.
        """
        if self._caught:
            return self._where_caught(time)
        if self._catch is None and time > self._lowering.time:
            self._catch = self._height - self._lowering.drop
        self._time, self._latest = time, self.model.predict(time)
        return self._latest

    def advance(self, contact_force: np.ndarray) -> None:
        """Take the step predicted last with these contact forces (s,) [N]."""
        if self._caught:
            return
        assert self._latest is not None
        height = self._latest.height - self._latest.height_compliance @ contact_force
        self.model.advance(contact_force)
        self._height = float(height.mean()) - self._base_at(self._time)[0]
        self._caught = self._catch is not None and self._height <= self._catch

    def state(self) -> np.ndarray:
        """The model's state, its height, where it is caught, and 0 before the lowering, 1 while it
        is lowered, 2 when it is caught."""
        lowered = self._catch is not None
        phase = float(lowered) + float(self._caught)
        return np.append(self.model.state(), [self._height, self._catch or 0.0, phase])

    def restore(self, state: np.ndarray) -> None:
        """Continue from what ``state`` returned."""
        self.model.restore(np.asarray(state)[:-3])
        self._height = float(state[-3])
        self._catch = float(state[-2]) if state[-1] >= 1.0 else None
        self._caught = bool(state[-1] == 2.0)

    def places(self) -> np.ndarray:
        """Where the model's masses or bodies are; those of what is caught as it was then."""
        return self.model.places()

    def base(self, time: float) -> float:
        """Height of the model's base [m]."""
        return self.model.base(time)

    def energy(self) -> float:
        """That of the model [J]; what is caught has none."""
        return 0.0 if self._caught else self.model.energy()

    def _where_caught(self, time: float) -> HeadState:
        assert self._catch is not None
        place, velocity = self._base_at(time)
        self._still.height[:] = self._catch + place
        self._still.velocity[:] = velocity
        return self._still

    def _base_at(self, time: float) -> tuple[float, float]:
        """Height [m] and velocity [m/s] of the base."""
        if self._base is None:
            return 0.0, 0.0
        vertical = self._base.vertical(time)
        return float(vertical.place), float(vertical.velocity)
