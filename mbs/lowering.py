"""A pantograph that is lowered under way: its lift's course, and what catches it.

The part of the lift that acts goes over to another one by half a cosine, as it does while a
pantograph is raised; a negative part pulls down. Models have no housing of their own: once the head
has gone down by a stated way it is caught. Its speed relative to the base falls to zero at once,
and it moves with the base.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from catenary.mbs.head.newmark_head import SteppedHead
from catenary.mbs.head.stepping import Part, Raising
from catenary.mbs.interface import (
    HeadState,
    Pantograph,
    called_by_kernels,
    drive_width,
    drives_by_name,
)
from catenary.mbs.vehicle import BaseMotion, lifted
from catenary.solver.kernels import native


@dataclass(frozen=True)
class Lowering:
    """Lowering of a pantograph from ``time`` [s] on.

    The static force goes over to ``force`` [N] over ``within`` [s]; the head is caught ``drop``
    [m] below where it was at ``time``.
    """

    time: float
    force: float
    within: float
    drop: float

    def course(self, static_force: float, raise_time: float) -> Part:
        """Part of the lift that acts, after a raising over ``raise_time`` [s] to ``static_force``
        [N]."""
        rising, falling = Raising(raise_time), Raising(self.within)
        before = rising(self.time)
        last = self.force / static_force

        def part(times: float | np.ndarray) -> np.ndarray:
            since = np.maximum(times - np.float64(self.time), 0.0)
            lowered = before + (last - before) * falling(since)
            return np.where(since > 0.0, lowered, rising(times))

        return part


class LoweredPantograph:
    """Any pantograph, lowered and caught.

    Attributes
    ----------
    stepped : the compiled head, for steps from Python and in the loop of kernels

    Parameters
    ----------
    model : the pantograph, whose lift follows the lowering already
    lowering : Lowering
    base : how the vehicle moves what catches the head; without it that stays
    """

    def __init__(
        self, model: Pantograph, lowering: Lowering, base: BaseMotion | None = None
    ) -> None:
        self.model, self._base = model, base
        if isinstance(model, SteppedHead):
            self._head, self._row, self.stepped = model.head, model.row, model.stepped
        else:
            self.stepped, self._head, _ = called_by_kernels(model)
            self._row = np.zeros(drive_width(len(model.strip_offsets)))
        self._now, self._memory = (
            drives_by_name(self._row),
            np.zeros(1, dtype=native.LOWERING_MEMORY),
        )
        self.stepped.lower(native.Lowering(lowering.time, lowering.drop, self._memory))

    @property
    def strip_offsets(self) -> tuple[float, ...]:
        return self.model.strip_offsets

    @property
    def is_caught(self) -> bool:
        """Whether it has been lowered and caught."""
        return bool(self._memory["phase"][0] == 2.0)

    def place(self, head_height: float, velocity: float = 0.0) -> None:
        """Put the model without contact to where its head is at ``head_height`` [m], moving upward
        with ``velocity`` [m/s]."""
        self.model.place(head_height, velocity)
        self._memory["height"] = head_height - lifted(self._base, 0.0)[0]

    def extrapolate(self, time: float) -> tuple[np.ndarray, np.ndarray]:
        if not self.is_caught:
            return self.model.extrapolate(time)
        place, velocity = lifted(self._base, time)
        s = len(self.strip_offsets)
        return np.full(s, self._memory["caught_at"][0] + place), np.full(s, velocity)

    def predict(self, time: float) -> HeadState:
        """Strips at ``time`` [s] as functions of the contact forces in the coming step.

        Forces do not move what is caught.
        """
        now = self._now
        now["time"] = time
        now["roof"], now["roof_velocity"] = lifted(self._base, time)
        if isinstance(self.model, SteppedHead):
            return self.model.predict(time)
        self.stepped.step(self._row)
        return self._head

    def advance(self, contact_force: np.ndarray) -> None:
        """Take the step predicted last with these contact forces (s,) [N]."""
        taken = self.model if isinstance(self.model, SteppedHead) else self.stepped
        if not self.is_caught:
            taken.advance(contact_force)

    def fill_drives(self, times: np.ndarray, drives: np.ndarray) -> None:
        """Fill in what steps to ``times`` [s] depend on, see `SteppedHead`."""
        if self._base is not None:
            rows = drives_by_name(drives)
            rows["roof"], rows["roof_velocity"], _ = self._base.lifts(times)
        if isinstance(self.model, SteppedHead):
            self.model.fill_drives(times, drives)

    def state(self) -> np.ndarray:
        """The model's state, its height, where it is caught, and 0 before the lowering, 1 while it
        is lowered, 2 when it is caught."""
        return np.append(self.model.state(), self._memory.view(float))

    def restore(self, state: np.ndarray) -> None:
        self.model.restore(np.asarray(state)[:-3])
        self._memory.view(float)[:] = state[-3:]

    def places(self) -> np.ndarray:
        """Places of the model's masses or bodies; once it is caught, those at that time."""
        return self.model.places()

    def base(self, time: float) -> float:
        return self.model.base(time)
