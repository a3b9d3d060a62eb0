"""Pantographs as the coupling and kernels step them, and those that step by Newmark's method.

Heights are measured like the line's, z up [m]; contact forces are >= 0 in compression and push
the head down. A head touches the wire with s strips, mostly one; where several contact wires run
side by side each of them may touch each strip, and what is said of strips holds for contacts, those
of one strip together. A pantograph lives on rank 0 and is never called elsewhere.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import Any
from weakref import WeakMethod

import numpy as np

from catenary.mbs.head.laws import Controller, Law, Regulation, Regulator, in_place
from catenary.mbs.head.stepping import Lowering, Part, Raising, Stepping
from catenary.mbs.head.strips import HeadParts
from catenary.mbs.interface import N_DRIVE, HeadState, drive_width, drives_by_name
from catenary.mbs.vehicle import BaseMotion, lifted
from catenary.solver.kernels import native

# A step that takes no time: what it finds are the accelerations of the state as it is.
NO_TIME = native.NewmarkFactors(0.0, 0.0, 0.0, 0.0, 0.0)


def weakly(method: Callable[..., Any]) -> Callable[..., None]:
    """A method for a compiled head to call: heads belong to models, and must not keep these.

    The call raises ReferenceError if the model is gone: no step may be left out in silence.
    """
    own = WeakMethod(method)

    def call(*arguments: Any) -> None:
        if (found := own()) is None:
            raise ReferenceError("the pantograph of a compiled head is gone")
        found(*arguments)

    return call


class Pantograph(ABC):
    """A pantograph that advances with the global contact step, which may be lowered and caught.

    Attributes
    ----------
    strip_offsets : places of the strips ahead of the pantograph's own place along the track [m]
    stepped : the compiled head, for steps from Python and in the loop of kernels
    head : HeadState, what it predicted last
    row : inputs of the coming step, see `interface.drives_by_name`
    violation : (1,) largest error of a row of joints [m, cosine], NaN without joints in the loop

    Parameters
    ----------
    strip_offsets : as above, (s,)
    base : how the vehicle moves; without it the base stays
    """

    stepped: native.Head
    # Height of the base at rest [m].
    _foot = 0.0

    def __init__(self, strip_offsets: tuple[float, ...], base: BaseMotion | None) -> None:
        s = len(strip_offsets)
        self.strip_offsets, self._base = strip_offsets, base
        self.head = HeadState(s)
        self.row = np.zeros(drive_width(s))
        self._rows = drives_by_name(self.row[None])
        self._lowered = np.zeros(0, dtype=native.LOWERING_MEMORY)
        self.violation = np.full(1, np.nan)

    @abstractmethod
    def follow(self, part: Part) -> None:
        """Scale the lift by ``part``; where it is negative, it pulls down."""

    def lower(self, lowering: Lowering) -> None:
        """Have the head caught when it has gone down; the lift follows the lowering already."""
        self._lowered = np.zeros(1, dtype=native.LOWERING_MEMORY)
        self.stepped.lower(native.Lowering(lowering.time, lowering.drop, self._lowered))

    @property
    def is_lowered(self) -> bool:
        """Whether it is lowered under way."""
        return self._lowered.size > 0

    @property
    def is_caught(self) -> bool:
        """Whether it has been lowered and caught."""
        return bool((self._lowered["phase"] == 2.0).any())

    def place(self, head_height: float, velocity: float = 0.0) -> None:
        """Put the pantograph without contact to where its head is at ``head_height`` [m], all of it
        moving upward with ``velocity`` [m/s].

        Raises
        ------
        RunBroken
            A mechanism does not reach this height.
        """
        self._place(head_height, velocity)
        self._lowered["height"] = head_height - lifted(self._base, 0.0)[0]

    @abstractmethod
    def _place(self, head_height: float, velocity: float) -> None:
        """As ``place``."""

    def extrapolate(self, time: float) -> tuple[np.ndarray, np.ndarray]:
        """Heights [m] and velocities [m/s] of the strips at ``time`` [s], the end of the coming
        step, by Newmark's predictor (paper eq. 2.5); (s,) each, overwritten by the next call."""
        if not self.is_caught:
            return self._extrapolate(time)
        place, velocity = lifted(self._base, time)
        s = len(self.strip_offsets)
        return np.full(s, self._lowered["caught_at"][0] + place), np.full(s, velocity)

    @abstractmethod
    def _extrapolate(self, time: float) -> tuple[np.ndarray, np.ndarray]:
        """As ``extrapolate``, unless it is caught."""

    def predict(self, time: float) -> HeadState:
        """Strips at ``time`` [s] as affine functions of the contact forces in the coming step,
        which do not move what is caught; overwritten by the next call.

        Raises
        ------
        RunBroken
            A mechanism has left the heights that it can reach, or its joints cannot be closed.
        """
        self._drive(time)
        if not self.stepped.step(self.row):
            self._refuse(self.stepped, time)
        return self.head

    def _drive(self, time: float) -> None:
        """Fill in the row of a step to ``time`` [s]."""
        self._put_drives(np.array([time]), self._rows)

    def _put_drives(self, times: np.ndarray, rows: np.ndarray) -> None:
        """Put into ``rows`` (n,) what steps to ``times`` (n,) [s] depend on besides the state and
        wires."""
        rows["time"] = times
        lifts = None if self._base is None else self._base.lifts(times)
        if lifts is not None:
            rows["roof"], rows["roof_velocity"] = lifts[:2]
        self._put_inputs(times, rows, lifts)

    def _put_inputs(  # noqa: B027  (a mechanism with all bodies reads its own)
        self, times: np.ndarray, rows: np.ndarray, lifts: np.ndarray | None
    ) -> None:
        """Put in the rest; ``lifts`` (3, n) is the motion of a base that moves."""

    def fill_drives(self, times: np.ndarray, drives: np.ndarray) -> None:
        """Fill in what steps to ``times`` [s] depend on besides the state, a row each.

        ``drives`` (len(times), `drive_width`) is what the loop of kernels steps it with.
        """
        self._put_drives(times, drives_by_name(drives))

    def _refuse(self, left: native.Head, time: float) -> None:  # noqa: B027  (chains are endless)
        """Raise RunBroken for a head that has left its heights in a step to ``time`` [s]."""

    def advance(self, contact_force: np.ndarray) -> None:
        """Take the step predicted last with the contact forces ``contact_force`` (s,) [N]."""
        self.stepped.advance(np.ascontiguousarray(contact_force, dtype=float))

    def state(self) -> np.ndarray:
        """State to continue from, as one array: the model's own; behind it, of one that is lowered,
        its height, where it is caught, and 0 before the lowering, 1 during it, 2 once caught."""
        return np.concatenate([*self._own_state(), self._lowered.view(float)])

    @abstractmethod
    def _own_state(self) -> list[np.ndarray]:
        """Parts of the model's own state."""

    def restore(self, state: np.ndarray) -> None:
        """Continue from what ``state`` returned."""
        memory = self._lowered.view(float)
        own, memory[:] = np.split(np.array(state, dtype=float), [len(state) - memory.size])
        self._restore(own)

    @abstractmethod
    def _restore(self, state: np.ndarray) -> None:
        """Continue from the model's own state."""

    @abstractmethod
    def places(self) -> np.ndarray:
        """Coordinates of its masses or bodies, (k,), in one array that steps keep up to date.

        Heights of lumped masses and of an arm, and angles of a head; of a mechanism that is moved
        body by body its positions and Euler parameters. Once it is caught, those at that time.
        """

    def base(self, time: float) -> float:
        """Height at ``time`` [s] of the base that a mechanism's points count from [m]; how far a
        vehicle has lifted it for lumped masses."""
        return self._foot + lifted(self._base, time)[0]


class SteppedHead(Pantograph):
    """A head's strips on n coordinates, the head's own first, which a step advances together.

    Parameters
    ----------
    head : HeadParts
    n : number of all coordinates; those that are not the head's are heights
    stepping : Stepping
    steady_air : whether forces of the air, if there are any, stay as they are once it is raised
    """

    _masses: np.ndarray
    _stiffness: np.ndarray
    _damping: np.ndarray
    _carrier: int
    _mechanism: native.ReducedMechanism | None = None

    def __init__(self, head: HeadParts, n: int, stepping: Stepping, steady_air: bool) -> None:
        raise_time, dt, beta, gamma, lateral, base = stepping
        super().__init__(head.offsets, base)
        s = len(head.offsets)
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
        roll = -1 if self._lateral is None else head.roll
        self._arrays = native.HeadArrays(
            self._touch, self._state, self.head.numbers, self._newmark, roll
        )
        # The time of what is in it, and when that stays as it is.
        self._driven = -np.inf
        self._settled = raise_time if steady_air and base is None else np.inf
        self._laws = in_place((), (), n, (), s)
        self._bending = None if self._lateral is None else head.bending
        self._control: native.Regulation | None = None
        self._controller: Controller | None = None

    def _step_by(self, stepped: native.Head) -> None:
        """Set the compiled head that steps this one, made of its arrays."""
        self.stepped = stepped
        if self._bending is not None:
            stepped.bend(self._bending)

    @property
    def by_hand(self) -> bool:
        """Whether a controller of one's own regulates it, in Python."""
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
            self.stepped.then(weakly(self._control_by_hand))

    def _control_by_hand(self, time: float, contact_force: np.ndarray) -> None:
        """Call the controller at the end of a step to ``time`` [s]."""
        assert self._controller is not None
        height = float((self._touch[0] @ self.position).mean())
        added = self._controller.added_force(time, float(contact_force.sum()), height)
        self.stepped.added_force = float(added)

    def follow(self, part: Part) -> None:
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
        return self.position

    def _place(self, head_height: float, velocity: float) -> None:
        """Springs between masses are relaxed."""
        n = self._n
        self._state[:n] = head_height * self._level
        self._state[n : 2 * n] = velocity * self._level
        # A start from any other acceleration than what these forces cause loses an order in dt.
        still = self._on_springs(self._arrays._replace(newmark=NO_TIME))
        super()._drive(0.0)
        self._driven = 0.0
        if not still.step(self.row):
            self._refuse(still, 0.0)
        still.advance(np.zeros(len(self.strip_offsets)))

    def _on_springs(self, arrays: native.HeadArrays) -> native.Head:
        """A compiled head on its springs and laws, by the factors of Newmark's method in arrays."""
        masses = self._masses, self._stiffness, self._damping, self._push
        driven = self._carrier, self._laws, self._mechanism
        return head_of(arrays, sprung=native.SprungMasses(*masses, *driven))

    def _drive(self, time: float) -> None:
        self._aim(time)
        if min(time, self._driven) < self._settled:
            super()._drive(time)
            self._driven = time
        self.row[0] = time

    def fill_drives(self, times: np.ndarray, drives: np.ndarray) -> None:
        """As of all; rows of heads that roll or bend have what is known of where wires cross."""
        super().fill_drives(times, drives)
        if self._lateral is not None:
            s = len(self.strip_offsets)
            self._lateral.fill_ahead(times, drives[:, N_DRIVE : N_DRIVE + 2 * s])

    def _extrapolate(self, time: float) -> tuple[np.ndarray, np.ndarray]:
        self._aim(time)
        self.stepped.extrapolate(self.row, self._early)
        return self._early[0], self._early[1]

    def _own_state(self) -> list[np.ndarray]:
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
        return parts

    def _restore(self, state: np.ndarray) -> None:
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
