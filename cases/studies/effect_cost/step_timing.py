"""Time of a step: marches over the same stretch again and again, several of them in turns.

Other programs slow all contenders alike, and the least of many rounds is what a step takes when
none does.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from catenary.base.errors import RunBroken
from catenary.solver.problem.problem import steps_of
from catenary.solver.statics.line_at_rest import LineAtRest
from catenary.solver.time_loop.march import March
from catenary.solver.time_loop.views.observers import NEVER, Observer, StepView


class Size(NamedTuple):
    """Unknowns of a line, of its stations (fewest, most), and of a cross-section by planes."""

    n_unknowns: int
    of_a_station: tuple[int, int]
    planes: tuple[int, ...]


class RepeatedMarch:
    """A march over some steps that starts again and again from one of its states.

    Collective to make. A context manager that destroys the march.

    Parameters
    ----------
    comm : mpi4py communicator
    at_rest : line that is marched
    first : step from which rounds start, which the march runs to once
    n_steps : of a round; those to the end of the run if there are fewer

    Raises
    ------
    RunBroken
        If the march does not come to the end of the first round.
    """

    def __init__(self, comm: Any, at_rest: LineAtRest, first: int = 0, n_steps: int = NEVER):
        problem = at_rest.problem
        train, dt = problem.train, problem.numerics.dt
        last = min(first + n_steps, steps_of(problem))
        if last < steps_of(problem):
            end = train.start + (last + 0.5) * dt * train.speed
            problem = replace(problem, train=replace(train, end=end))
        self._comm = comm
        self._march = March(comm, problem, at_rest.model, at_rest.form, at_rest.lift)
        numbering = at_rest.model.numbering
        of_stations = list(map(len, numbering.station_types))
        fewest_and_most = min(of_stations), max(of_stations)
        self.size = Size(numbering.n_unknowns, fewest_and_most, self._march.station_widths)
        kept = _Kept(first)
        outcome = self._march.run([kept])
        if outcome.outcome != "done":
            self._march.destroy()
            raise RunBroken(outcome.outcome)
        self._state = comm.bcast(kept.state)

    def step_cost(self) -> float:
        """Time of a step of one more round [us], on the slowest rank. Collective."""
        self._march.restore(self._state)
        outcome = self._march.run([])
        cost = 1e6 * outcome.wall / max(1, outcome.n_steps)
        return float(max(self._comm.allgather(cost)))

    def destroy(self) -> None:
        """Collective."""
        self._march.destroy()

    def __enter__(self) -> RepeatedMarch:
        return self

    def __exit__(self, *error: object) -> None:
        self.destroy()


class _Kept(Observer):
    """Observer that keeps the state of one step."""

    def __init__(self, step: int) -> None:
        self._step = step
        self.state: dict[str, Any] | None = None

    def next_state(self, step: int) -> int:
        """The step that is kept, then none."""
        return self._step if step < self._step else NEVER

    def observe(self, view: StepView) -> None:
        """Keep the state of the step."""
        if view.step == self._step:
            self.state = view.checkpoint()


class Beside(NamedTuple):
    """Steps of a march beside those of another: least times [us], and their ratio."""

    least: float
    least_of_other: float
    ratio: float


def beside(march: RepeatedMarch, other: RepeatedMarch, rounds: int) -> Beside:
    """Time of steps of a march over the time of steps of an ``other`` one. Collective.

    A round marches both twice, as in a b b a, and takes the lesser of each. The ratio is the median
    of rounds: where the machine slows down for some of them, it does so for both.
    """
    found = np.empty((rounds, 2))
    for number in range(rounds):
        a, b, again, last = (m.step_cost() for m in (march, other, other, march))
        found[number] = min(a, last), min(b, again)
    least = found.min(axis=0)
    return Beside(float(least[0]), float(least[1]), float(np.median(found[:, 0] / found[:, 1])))


def in_turns(marches: Mapping[str, RepeatedMarch], rounds: int) -> dict[str, float]:
    """Least time of a step of each of several marches, by name [us]. Collective.

    In each of ``rounds`` rounds the marches take turns.
    """
    least = dict.fromkeys(marches, np.inf)
    for _ in range(rounds):
        for name, march in marches.items():
            least[name] = min(least[name], march.step_cost())
    return least
