"""Steps that adapt: an interval of the record is divided into shorter steps where that is needed.

The record keeps its step dt, on which filters and statistics rely. Within an interval steps have
the size dt / 2^level. Each level has operators, columns, pantographs and a scheme of its own, made
when it is first needed and kept. Level 0 holds the state whenever an interval ends, so that
records, checkpoints and incidents are independent of the others.

A step is repeated with a shorter one if its estimated error is above the tolerance, or if it has no
solution; `StepSize` controls the size of the next.

Average acceleration misses h^3 / 12 times the third derivative of a motion in a step of h. At a
contact the motion is the depth, whose latest values a march has. With the second
derivatives a, twice the divided differences, of this step and the one before, the depth is wrong by
h^2 / 12 (a_n - a_n-1) (Zienkiewicz and Xie 1991, for beta = 1/4), and the force by this times the
stiffness of the contact. What changes within a step (a landing, a kink of the force) is thereby
taken to happen in this step. Without contact at either end the depth moves no force.

Where contact is made within a step, at a share s of it, the force f at its end acts for the whole
step: the impulse is wrong by s h f / 2 < h f / 2, which sets head and wire swinging on the contact.
With k its stiffness, m the mass that swings and D = h^2 / 4 m what a force takes off the depth
within a step, the force is wrong by k h f / (2 m omega) = sqrt(k D) f. Likewise where it is lost.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from catenary.base.errors import RunBroken
from catenary.solver.problem.problem import Numerics, n_halvings
from catenary.solver.schemes.fixed_point import FixedPoint
from catenary.solver.schemes.make_scheme import Parts
from catenary.solver.schemes.scheme import Counters, Decision, OneSolve, Scheme, StepRejected

# Steps before this one that the estimate needs.
_PAST = 3


class StepError:
    """The estimate for n contacts, with the depths that it remembers. On rank 0; not collective."""

    def __init__(self, n: int) -> None:
        # Ends of the latest steps [s] and depths there [m], oldest first; forces at the last [N].
        self._times, self._depths = [0.0] * _PAST, [[0.0] * n] * _PAST
        self._forces = [0.0] * n
        self._known = 0

    def of(
        self,
        time: float,
        depth: np.ndarray,
        force: np.ndarray,
        stiffness: np.ndarray,
        compliance: np.ndarray,
    ) -> float | None:
        """Largest error of a contact force by a step to ``time`` [N]; None while it is unknown.

        Parameters
        ----------
        time : float
            End of the step [s].
        depth, force, stiffness : ndarray, shape (n,)
            Depths, forces and tangent stiffnesses of the contacts [m], [N], [N/m].
        compliance : ndarray, shape (n,)
            D, depth that a unit force takes off within the step [m/N].
        """
        if self._known < _PAST:
            return None
        t0, t1, t2 = self._times
        largest, step = 0.0, time - t2
        given = (values.tolist() for values in (depth, force, stiffness, compliance))
        for d0, d1, d2, before, d, now, k, by in zip(
            *self._depths, self._forces, *given, strict=True
        ):
            if before > 0.0 or now > 0.0:
                rates = (d - d2) / step, (d2 - d1) / (t2 - t1), (d1 - d0) / (t1 - t0)
                change = (rates[0] - rates[1]) / (time - t1) - (rates[1] - rates[2]) / (t2 - t0)
                largest = max(largest, k * (step * step / 6.0 * abs(change)))
            if (before > 0.0) != (now > 0.0):
                largest = max(largest, math.sqrt(k * by) * max(before, now))
        return largest

    def accept(self, time: float, depth: np.ndarray, force: np.ndarray) -> None:
        """Store an accepted step to ``time`` [s]: depths [m] and forces [N] (n,) at its end."""
        self._times = [*self._times[1:], time]
        self._depths = [*self._depths[1:], depth.tolist()]
        self._forces = force.tolist()
        self._known = min(self._known + 1, _PAST)

    def state(self) -> np.ndarray:
        """Memory of the estimate, as one array of fixed length."""
        return np.array([self._known, *self._forces, *self._times, *np.ravel(self._depths)])

    def restore(self, state: np.ndarray) -> None:
        """Continue from what ``state`` returned."""
        n = len(self._forces)
        self._known = int(state[0])
        parts = np.split(state[1:], n + np.array([0, _PAST, _PAST + n, _PAST + 2 * n]))
        self._forces, self._times, *self._depths = (part.tolist() for part in parts)


# A size that is shorter than a level's by less than this share of a halving is taken for it, so
# that the safety factor alone does not shorten steps that are good enough.
_ROUNDED = 0.2


# The local error of a step of a method of order two falls with the cube of its size.
_ORDER = 3
# Share of the size for which the error would be the tolerance, and a factor of it for a step that
# is rejected a second time.
_SAFETY, _AFTER_REJECTION = 0.9, 0.5
# A size changes by these factors at most from a step to the next.
_LEAST, _MOST = 0.1, 10.0
_AFTER_FAILURE = 0.25


@dataclass
class StepSize:
    """Controls the error per step (Hairer, Norsett and Wanner, Solving ODEs I, section II.4).

    The next size is ``s h (tolerance / error)^(1/3)`` with a safety factor s, by the rules of
    PETSc's ``TSADAPTBASIC`` with its usual options. Not collective.

    Parameters
    ----------
    tolerance : of the estimated error of a step [N]
    longest, smallest : limits of the step size [s]
    """

    tolerance: float
    longest: float
    smallest: float
    _accepted: bool = field(default=True, init=False)

    def after_step(self, error: float, size: float) -> tuple[bool, float]:
        """Whether to take a step of ``size`` [s] that is wrong by ``error`` [N], and the size [s]
        of the next, or of its repetition. The smallest is taken in any case."""
        good = error <= self.tolerance
        safety = _SAFETY if good or self._accepted else _SAFETY * _AFTER_REJECTION
        factor = safety * (self.tolerance / error) ** (1 / _ORDER) if error > 0.0 else _MOST
        wanted = size * min(max(factor, _LEAST), _MOST)
        self._accepted = good or size < (1 + 1e-8) * self.smallest
        return self._accepted, min(max(wanted, self.smallest), self.longest)

    def after_failure(self, size: float) -> float:
        """Size [s] with which to repeat a step of ``size`` [s] that has no solution."""
        self._accepted = False
        return _AFTER_FAILURE * size


@dataclass
class LevelCounters(Counters):
    """Counts of steps of all sizes.

    ``rejected_steps``: repeated because of their estimated error; ``failed_steps``: repeated
    because they had no solution; ``steps_above_tolerance``: taken all the same, being the shortest
    (counted on rank 0). ``taken`` are those of each level, of ``sizes`` [s].
    """

    rejected_steps: int = 0
    failed_steps: int = 0
    steps_above_tolerance: int = 0
    taken: list[int] = field(default_factory=list)
    sizes: list[float] = field(default_factory=list)

    def as_dict(self) -> dict[str, int]:
        """Names and counts, those of sizes named after them."""
        counts = super().as_dict()
        for name in ("taken", "sizes"):
            del counts[name]
        sizes = zip(self.sizes, self.taken, strict=True)
        return {**counts, **{f"steps_of_{1e3 * size:.4g}_ms": n for size, n in sizes}}


class StepLevels(Scheme):
    """A scheme that takes the interval of the record in steps of another one. Collective.

    Attributes
    ----------
    pantographs : of the level that was stepped last

    Parameters
    ----------
    comm : mpi4py communicator
    numerics : of the run, with ``adaptive_tolerance`` and ``smallest_dt``
    whole : parts that step the whole interval; their maker destroys them, but for the scheme
    finer : makes what takes steps of dt / 2^level; collective
    """

    def __init__(
        self, comm: Any, numerics: Numerics, whole: Parts, finer: Callable[[int], Parts]
    ) -> None:
        assert numerics.adaptive_tolerance is not None
        self._comm = comm
        self._dt = numerics.dt
        self._tolerance = numerics.adaptive_tolerance
        self._finest = n_halvings(numerics.dt, numerics.smallest_dt)
        self._finer = finer
        self._levels: dict[int, Parts] = {}
        self._counters = LevelCounters(
            taken=[0] * (self._finest + 1),
            sizes=[self._dt / 2**level for level in range(self._finest + 1)],
        )
        self._error = StepError(whole.pantographs.n_contacts)
        self.pantographs = whole.pantographs
        self._active = self._wanted = self._tried = 0
        self._before: dict[int, list[np.ndarray]] = {}
        self._size = StepSize(self._tolerance, self._dt, self._dt / 2**self._finest)
        self._take_in(0, whole)

    @property
    def counters(self) -> Counters:
        """Counters of all levels together."""
        return self._counters

    @counters.setter
    def counters(self, counters: Counters) -> None:
        assert isinstance(counters, LevelCounters)  # those of the line before an incident
        self._counters = counters
        for parts in self._levels.values():
            parts.scheme.counters = counters

    def step(self, time: float, stop: bool) -> bool:
        whole, done, goes_on = 2**self._finest, 0, True
        while done < whole:
            level = self._wanted
            while done % (whole >> level):
                level += 1  # a longer step would not end where the interval does
            size = whole >> level
            at = time - self._dt * (whole - done - size) / whole
            answer = self._try(level, at, stop)
            if answer is not None:
                goes_on &= answer
                done += size
        # Observers and checkpoints read level 0; this run continues from the same state.
        self._go_to(0)
        return goes_on

    def decide(
        self,
        time: float,
        depth: np.ndarray,
        force: np.ndarray,
        stiffness: np.ndarray,
        compliance: np.ndarray,
    ) -> Decision:
        level, size = self._tried, self._dt / 2**self._tried
        error = self._error.of(time, depth, force, stiffness, compliance)
        decision = Decision(True, level)
        if error is not None:
            accepted, wanted = self._size.after_step(error, size)
            accepted |= level == self._finest
            decision = Decision(accepted, self._level_of(wanted))
            self._counters.steps_above_tolerance += accepted and error > self._tolerance
        if decision.accepted:
            self._error.accept(time, depth, force)
        return decision

    def set_level(self, level: int) -> None:
        self._wanted = level

    def state(self) -> np.ndarray:
        """The level of the next step, what the estimate remembers, and what the scheme does."""
        return np.concatenate(
            [[self._wanted], self._error.state(), self._levels[0].scheme.state()], dtype=float
        )

    def restore(self, state: np.ndarray) -> None:
        """Continue from what ``state`` returned; line and pantographs are those of level 0."""
        n = self._error.state().size
        self._wanted, self._active = int(state[0]), 0
        self._error.restore(state[1 : 1 + n])
        self._levels[0].scheme.restore(state[1 + n :])

    def destroy(self) -> None:
        """Free all PETSc objects but those of the line at level 0. Collective."""
        self._levels.pop(0).scheme.destroy()
        for parts in self._levels.values():
            parts.destroy()

    def _try(self, level: int, time: float, stop: bool) -> bool | None:
        """A step of a level to ``time`` [s]: what its scheme says, None if it is to be repeated."""
        parts = self._go_to(level)
        self._tried = level
        take_back = self._remember(level)
        try:
            goes_on = parts.scheme.step(time, stop)
        except StepRejected:
            self._counters.rejected_steps += 1
        except RunBroken:
            if level == self._finest:
                raise
            self._counters.failed_steps += 1
            self._wanted = self._level_of(self._size.after_failure(self._dt / 2**level))
        else:
            self._counters.taken[level] += 1
            return goes_on
        take_back()
        self._wanted = max(self._wanted, level + 1)
        return None

    def _level_of(self, size: float) -> int:
        """The level whose steps are at most of this size [s], or nearly."""
        level = math.ceil(math.log2(self._dt / size) - _ROUNDED)
        return min(max(level, 0), self._finest)

    def _go_to(self, level: int) -> Parts:
        """Parts that take steps of a level, made if need be and brought to the present state."""
        if level not in self._levels:
            self._take_in(level, self._finer(level))
        if level != self._active:
            _hand_over(self._levels[self._active], self._levels[level])
            self._active, self.pantographs = level, self._levels[level].pantographs
        return self._levels[level]

    def _take_in(self, level: int, parts: Parts) -> None:
        assert isinstance(parts.scheme, OneSolve | FixedPoint)
        parts.scheme.judge = self
        parts.scheme.counters = self._counters
        self._levels[level] = parts
        self._before[level] = [np.empty_like(values) for values in parts.line.kept()]

    def _remember(self, level: int) -> Callable[[], None]:
        """Keep the state before a step; returns what brings it back.

        A step that is repeated has moved the line. It has moved pantographs, and what contacts
        remember, only if it failed after the forces were found, which joints alone can make it do.
        """
        parts, before = self._levels[level], self._before[level]
        kept = parts.line.kept()
        for copied, values in zip(before, kept, strict=True):
            np.copyto(copied, values)
        moved = parts.pantographs
        models = [model.state() for model in moved.models] if moved.joints_in_loop else []
        contacts = (self._error.state(), parts.scheme.state()) if moved.joints_in_loop else None

        def take_back() -> None:
            for copied, values in zip(before, kept, strict=True):
                np.copyto(values, copied)
            for model, state in zip(moved.models, models, strict=False):
                model.restore(state)
            if contacts is not None:
                self._error.restore(contacts[0])
                parts.scheme.restore(contacts[1])

        return take_back


def _hand_over(source: Parts, target: Parts) -> None:
    """Bring ``target`` to the state of ``source``. Not collective."""
    target.line.restore(source.line.state())
    target.scheme.restore(source.scheme.state())
    target.pantographs.take_over(source.pantographs)
