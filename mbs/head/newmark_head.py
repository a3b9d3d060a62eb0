"""Base of all pantographs that step by Newmark's method: their state, their strips, contact."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any

import numpy as np

from catenary.mbs.head.laws import Controller, Law, Regulation, Regulator, in_place
from catenary.mbs.head.stepping import Part, Raising, Stepping
from catenary.mbs.head.strips import HeadParts
from catenary.mbs.interface import N_DRIVE, HeadState, drive_width, drives_by_name
from catenary.solver.kernels import native

# A step that takes no time: what it finds are the accelerations of the state as it is.
_NO_TIME = native.NewmarkFactors(0.0, 0.0, 0.0, 0.0, 0.0)


class SteppedHead(ABC):
    """A head's strips on n coordinates, the head's own first, which a step advances together.

    Attributes
    ----------
    stepped : the compiled head, for steps from Python and in the loop of kernels
    head : HeadState, what it predicted last
    row : inputs of the coming step, see `interface.drives_by_name`

    Parameters
    ----------
    head : HeadParts
    n : number of all coordinates; those that are not the head's are heights
    stepping : Stepping
    steady_air : whether forces of the air, if there are any, stay as they are once it is raised
    """

    stepped: native.Head
    _masses: np.ndarray
    _stiffness: np.ndarray
    _damping: np.ndarray
    _carrier: int
    _mechanism: native.ReducedMechanism | None = None

    def __init__(self, head: HeadParts, n: int, stepping: Stepping, steady_air: bool) -> None:
        raise_time, dt, beta, gamma, lateral, self._base = stepping
        s = len(head.offsets)
        self.strip_offsets = head.offsets
        # The place of the wire on strips of a head that cannot roll makes no difference.
        moves = head.roll >= 0 or head.bending is not None
        self._part: Part = Raising(raise_time)
        self._n, self._lateral = n, lateral if moves else None
        self._level = np.ones(n)
        self._level[: head.n] = head.level
        self._touch = np.zeros((2, s, n))
        self._touch[0, :, : head.n] = head.touch
        # Share of a force on the middle of the strips in the force on each coordinate.
        self._push = np.zeros(n)
        self._push[: head.n] = head.touch.mean(axis=0)
        self._newmark = native.NewmarkFactors(
            dt, dt**2 * (0.5 - beta), dt * (1.0 - gamma), beta * dt**2, gamma * dt
        )
        self._state = np.zeros(3 * n)
        self._early = np.zeros((2, s))
        self.head = HeadState(s)
        roll = -1 if self._lateral is None else head.roll
        self._arrays = native.HeadArrays(
            self._touch, self._state, self.head.numbers, self._newmark, roll
        )
        self.row = np.zeros(drive_width(s))
        self._rows = drives_by_name(self.row[None])
        # The time of what is in it, and when that stays as it is.
        self._driven = -np.inf
        self._settled = raise_time if steady_air and self._base is None else np.inf
        self._laws = in_place((), (), n, (), s)
        self._bending = None if self._lateral is None else head.bending
        self._control: native.Regulation | None = None
        self._controller: Controller | None = None
        self._time = 0.0

    def _step_by(self, stepped: native.Head) -> None:
        """Set the compiled head that steps this one, made of its arrays."""
        self.stepped = stepped
        if self._bending is not None:
            stepped.bend(self._bending)

    @property
    def by_hand(self) -> bool:
        """Whether a controller of one's own regulates it, which no kernel calls."""
        return self._controller is not None

    @property
    def is_crossed(self) -> bool:
        """Whether it matters where wires cross its strips: to a head that rolls or bends."""
        return self._lateral is not None

    @property
    def levers(self) -> np.ndarray:
        """Levers of the strips on all coordinates at the start, and numbers of the tables of modes
        of strips that bend, one after another."""
        modes = () if self._bending is None else self._bending.tables.coefficients.ravel()
        return np.append(self._touch[0], modes)

    @property
    def is_regulated(self) -> bool:
        """Whether a controller changes its lift under way."""
        return self._control is not None or self.by_hand

    @property
    def base_height(self) -> float:
        """Height [m] that a step adds to that of the base in its row; none to what laws read."""
        return 0.0 if self._mechanism is None or self._has_laws else self._mechanism.zero

    def steps_as(self, other: SteppedHead) -> bool:
        """Whether a step of both depends on state, row and contact forces alike, but for the height
        that it adds to the base. A regulated lift counts as another."""
        if self.is_regulated or other.is_regulated:
            return False
        return all(map(np.array_equal, self._numbers(), other._numbers()))

    def _numbers(self) -> list[Any]:
        """What a step depends on besides state, row, forces and `base_height`."""
        own = [self._masses, self._stiffness, self._damping, self._push, self.levers]
        if self._mechanism is not None:
            tables, weight, zero = self._mechanism
            own += [*tables, weight, zero - self.base_height]
        return own + list(self._laws[:3])

    def regulate(self, regulator: Regulator | None) -> None:
        """Regulate the lift from the start on; None leaves it as it is."""
        if isinstance(regulator, Regulation):
            self._control = regulator.arrays(self._newmark.dt)
            self.stepped.regulate(self._control)
        elif regulator is not None:
            self._controller = regulator()

    def follow(self, part: Part) -> None:
        """Scale the lift by ``part``."""
        self._part, self._settled = part, np.inf

    @property
    def tie(self) -> tuple[float, float]:
        """Spring [N/m] and damper [N s/m] by which rows of ``fill_drives`` turn the motion of the
        base into a force; none where a head reads that motion itself."""
        return 0.0, 0.0

    @property
    def added_force(self) -> float:
        """Force that the regulation of the lift adds to the static force now [N]."""
        return self.stepped.added_force

    @property
    def _has_laws(self) -> bool:
        return self._laws.law.size > 0

    def _put_laws(
        self, laws: Sequence[Law], numbers: Sequence[int], rest: Sequence[float] | np.ndarray
    ) -> None:
        """Add nonlinear laws on head and masses, with the coordinates ``numbers`` and at the
        heights ``rest`` [m] under the static force."""
        self._laws = in_place(laws, numbers, self._n, rest, len(self.strip_offsets))

    @property
    def position(self) -> np.ndarray:
        """Heights [m] and angles [rad], the head's first, shape (n,)."""
        return self._state[: self._n]

    @property
    def velocity(self) -> np.ndarray:
        """Velocities, upward, shape (n,) [m/s] or [rad/s]."""
        return self._state[self._n : 2 * self._n]

    def places(self) -> np.ndarray:
        """Heights [m] and angles [rad], the head's first, shape (n,); a view of the state."""
        return self.position

    def place(self, head_height: float, velocity: float = 0.0) -> None:
        """Put the pantograph without contact to where its head is at this height [m].

        Springs between its masses are relaxed, and all move upward with ``velocity`` [m/s].
        """
        n = self._n
        self._state[:n] = head_height * self._level
        self._state[n : 2 * n] = velocity * self._level
        # A start from any other acceleration than what these forces cause loses an order in dt.
        still = self._on_springs(self._arrays._replace(newmark=_NO_TIME))
        self._drive(0.0)
        if not still.step(self.row):
            self._refuse(still, 0.0)
        still.advance(np.zeros(len(self.strip_offsets)))

    def predict(self, time: float) -> HeadState:
        """Strips at ``time`` [s] as affine functions of the contact forces in the coming step.

        Raises
        ------
        RunBroken
            A mechanism has left the heights that it can reach.
        """
        self._aim(time)
        if min(time, self._driven) < self._settled:
            self._drive(time)
        if not self.stepped.step(self.row):
            self._refuse(self.stepped, time)
        return self.head

    def _refuse(self, left: native.Head, time: float) -> None:  # noqa: B027  (chains are endless)
        """Raise RunBroken for a head that has left its heights in a step to ``time`` [s]."""

    def _on_springs(self, arrays: native.HeadArrays) -> native.Head:
        """A compiled head on its springs and laws, by the factors of Newmark's method in arrays."""
        masses = self._masses, self._stiffness, self._damping, self._push
        driven = self._carrier, self._laws, self._mechanism
        return head_of(arrays, sprung=native.SprungMasses(*masses, *driven))

    def _drive(self, time: float) -> None:
        self._put_drives(np.array([time]), self._rows)
        self._driven = time

    @abstractmethod
    def _put_drives(self, times: np.ndarray, rows: np.ndarray) -> None:
        """Put into ``rows`` (n,) what steps to ``times`` (n,) [s] depend on besides the state and
        wires."""

    def fill_drives(self, times: np.ndarray, drives: np.ndarray) -> None:
        """Fill in what steps to ``times`` [s] depend on besides the state, a row each.

        ``drives`` (len(times), `drive_width`) is what the loop of kernels steps it with; of heads
        that roll or bend it has what is known of where wires cross their strips.
        """
        self._put_drives(times, drives_by_name(drives))
        if self._lateral is not None:
            s = len(self.strip_offsets)
            self._lateral.fill_ahead(times, drives[:, N_DRIVE : N_DRIVE + 2 * s])

    def extrapolate(self, time: float) -> tuple[np.ndarray, np.ndarray]:
        """Heights and velocities (s,) of the strips by Newmark's predictor (paper eq. 2.5)."""
        self._aim(time)
        self.stepped.extrapolate(self.row, self._early)
        return self._early[0], self._early[1]

    def advance(self, contact_force: np.ndarray) -> None:
        self.stepped.advance(np.ascontiguousarray(contact_force, dtype=float))
        if self._controller is not None:
            height = float((self._touch[0] @ self.position).mean())
            total = float(contact_force.sum())
            added = self._controller.added_force(self._time, total, height)
            self.stepped.added_force = float(added)

    def state(self) -> np.ndarray:
        """Positions, velocities and accelerations (3 n,); behind them the latest contact forces of
        a head with laws, and what regulates the lift remembers."""
        parts = [self._state]
        if self._has_laws:
            parts.append(self._laws.pressed)
        if self._control is not None:
            parts += [self._control.memory.view(float), self._control.waiting]
        elif self._controller is not None:
            own = np.asarray(self._controller.state(), dtype=float).ravel()
            parts += [np.array([self.added_force]), own]
        return np.concatenate(parts)

    def restore(self, state: np.ndarray) -> None:
        begin = self._state.size
        self._state[:] = state[:begin]
        if self._has_laws:
            pressed = self._laws.pressed
            pressed[:] = state[begin : begin + pressed.size]
            begin += pressed.size
        if self._control is not None:
            memory = self._control.memory.view(float)
            memory[:], self._control.waiting[:] = np.split(state[begin:], [memory.size])
        elif self._controller is not None:
            self.stepped.added_force = float(state[begin])
            self._controller.restore(np.array(state[begin + 1 :]))

    def _aim(self, time: float) -> None:
        """Set the place of the wire on the strips at ``time`` [s], the end of the coming step."""
        self._time = time
        if self._lateral is not None:
            self._lateral.move_to(time)
            s = self._lateral.place.size
            self.row[N_DRIVE : N_DRIVE + s] = self._lateral.place
            self.row[N_DRIVE + s :] = self._lateral.rate


def head_of(
    arrays: native.HeadArrays,
    linear: native.LinearStep | None = None,
    sprung: native.SprungMasses | None = None,
) -> native.Head:
    """A compiled head of one of these models."""
    return native.Head(native.HeadParts(arrays, 0, linear, sprung, None, None, None))
