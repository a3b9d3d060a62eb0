"""Times marches of one and of two ranks in turns, in the same processes, and prints JSON.

mpirun -n 2 python -m mpi4py scaling.py SPANS TURNS STEPS

Each turn takes the same steps from the same state in all of these, and tells us a step:

    one     SPANS on rank 0, while the other rank sleeps
    two     SPANS on both ranks
    twice   twice SPANS on both ranks
    halves  half of SPANS on each rank, which do not talk to each other
    each    SPANS on each rank, which do not talk to each other
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable
from dataclasses import replace

from mpi4py import MPI
from step_cost import room

from catenary.cases.scene.load import load_scene
from catenary.cases.studies.hard.runs import at_rest
from catenary.solver.time_loop.march import March
from catenary.solver.time_loop.views.observers import Observer, StepView

WORLD = MPI.COMM_WORLD


class Timed(Observer):
    """A march that starts again and again, and keeps its first state for that. Collective."""

    def __init__(self, comm: MPI.Comm, n_spans: int, n_steps: int) -> None:
        scene = load_scene("ambrosio2012", [f"line.n_spans={n_spans}", *room(n_spans)])
        rest = at_rest(scene, WORLD)
        train = rest.problem.train
        length = n_steps * rest.problem.numerics.dt * train.speed
        problem = replace(rest.problem, train=replace(train, end=train.start + length))
        self._march = March(comm, problem, rest.model, rest.form, rest.lift)
        self._march.run([self])

    def next_state(self, step: int) -> int:
        return step + 1

    def observe(self, view: StepView) -> None:
        if view.step == 0:
            self._first = WORLD.bcast(view.checkpoint())

    def finish(self, outcome: str) -> None:
        assert outcome == "done"

    def step_cost(self) -> float:
        """Take the steps once more; mean time of a step on this rank [s]."""
        self._march.restore(self._first)
        outcome = self._march.run([])
        return outcome.wall / outcome.n_steps

    def destroy(self) -> None:
        self._march.destroy()


def on_both(timed: Timed) -> float:
    """Slower of both ranks."""
    WORLD.Barrier()
    return float(WORLD.allreduce(timed.step_cost(), MPI.MAX))


def on_first(timed: Timed) -> float:
    """On rank 0 alone. The other one does not even look whether it is over more than now and
    then."""
    WORLD.Barrier()
    cost = timed.step_cost() if WORLD.rank == 0 else 0.0
    over = WORLD.Ibarrier()
    while not over.Test():
        time.sleep(0.002)
    return float(WORLD.bcast(cost))


def main(n_spans: int, n_turns: int, n_steps: int) -> None:
    alone, half = (Timed(MPI.COMM_SELF, n, n_steps) for n in (n_spans, n_spans // 2))
    shared, twice = (Timed(WORLD, n, n_steps) for n in (n_spans, 2 * n_spans))
    runs: dict[str, tuple[Callable[[Timed], float], Timed]] = {
        "one": (on_first, alone),
        "two": (on_both, shared),
        "twice": (on_both, twice),
        "halves": (on_both, half),
        "each": (on_both, alone),
    }
    found: dict[str, list[float]] = {name: [] for name in runs}
    for _ in range(n_turns):
        for name, (run, timed) in runs.items():
            found[name].append(1e6 * run(timed))
    for timed in (alone, half, shared, twice):
        timed.destroy()
    if WORLD.rank == 0:
        print(json.dumps(found))


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
