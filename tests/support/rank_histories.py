"""Histories of a march on one rank and on all, and how far they differ."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np
from mpi4py import MPI

from catenary.base.parallel import on_root
from catenary.meshgen.mesh import LineMesh
from catenary.solver.problem.problem import Problem
from catenary.solver.statics.line_at_rest import LineAtRest, line_at_rest
from catenary.solver.time_loop.march import March
from catenary.solver.time_loop.views.observers import Observer, Stage, StepView

T = TypeVar("T")


class Histories(Observer):
    """Observer that keeps what it is shown and joins the ranks' parts."""

    def __init__(self, comm: Any) -> None:
        self._comm = comm
        self._rows: dict[str, list[np.ndarray]] = {"force": [], "arms": [], "droppers": []}

    def start(self, stage: Stage) -> None:
        self._stage = stage

    def next_state(self, step: int) -> int:
        return step + 1

    def observe(self, view: StepView) -> None:
        self._rows["force"].append(view.contact_force.copy())
        self._rows["arms"].append(view.arm_uplift.copy())
        self._rows["droppers"].append(view.dropper_force.copy())

    def finish(self, outcome: str) -> None:
        assert outcome == "done"

    def joined(self) -> dict[str, np.ndarray] | None:
        """All histories on rank 0, None elsewhere. Collective."""
        stage = self._stage
        result = {"force": np.array(self._rows["force"])}
        for name, owned, total in (
            ("arms", stage.owned_arms, stage.arm_x.size),
            ("droppers", stage.owned_droppers, stage.dropper_x.size),
        ):
            parts = self._comm.gather((owned, np.array(self._rows[name])), root=0)
            if parts is not None:
                whole = np.full((len(self._rows[name]), total), np.nan)
                for numbers, values in parts:
                    whole[:, numbers] = values
                result[name] = whole
        return result if self._comm.rank == 0 else None


class Watching(Observer):
    """Keeps forces and energies of each state, and on all ranks the checkpoint of step ``kept``."""

    def __init__(self, kept: int = -1) -> None:
        self._kept = kept
        self.checkpoint: dict[str, Any] | None = None
        self.rows: list[np.ndarray] = []

    def next_state(self, step: int) -> int:
        return step + 1

    def observe(self, view: StepView) -> None:
        self.rows.append(np.array([*view.contact_force, *view.energies()]))
        if view.step == self._kept:
            self.checkpoint = MPI.COMM_WORLD.bcast(view.checkpoint())

    def finish(self, outcome: str) -> None:
        assert outcome == "done"


def histories(comm: Any, problem: Problem, mesh: LineMesh) -> dict[str, np.ndarray] | None:
    """March a problem on ``comm`` and return its histories on rank 0. Collective."""
    march = March(comm, *line_at_rest(problem, mesh))
    watched = Histories(comm)
    march.run([watched])
    march.destroy()
    return watched.joined()


def on_one(run: Callable[[Any], T]) -> T:
    """What ``run`` returns of a communicator of rank 0 alone, on all ranks. Collective. The others
    sleep until it is done: there may be fewer cores than ranks."""
    return on_root(MPI.COMM_WORLD, lambda: run(MPI.COMM_SELF), takes_long=True)


def watched(
    comm: Any, rest: LineAtRest, kept: int = -1, since: dict[str, Any] | None = None
) -> Watching:
    """March on ``comm``, from a checkpoint or from the start. Collective; a step is ``kept`` on all
    ranks only."""
    watching = Watching(kept)
    with March(comm, *rest) as march:
        if since is not None:
            march.restore(since)
        march.run([watching])
    return watching


def check_ranks(rest: LineAtRest, kept: int = 150, within: float = 1e-9) -> None:
    """March on one rank and on all, and on all again from the state of step ``kept``. Collective.

    Fails unless forces and energies of both differ by at most ``within`` of the largest, and a run
    that is continued repeats the other to the last bit. `test_same_answers` has the tolerance.
    """
    world = MPI.COMM_WORLD
    found = on_one(lambda comm: watched(comm, rest)), watched(world, rest, kept=kept)
    assert found[1].checkpoint is not None
    again = watched(world, rest, since=found[1].checkpoint)
    alone, shared = (np.array(watching.rows) for watching in found)
    assert alone.shape == shared.shape
    assert world.rank > 0 or np.ptp(shared[:, 0]) > 50.0
    # Contact forces are rank 0's, energies the line's.
    own = slice(0 if world.rank == 0 else 1, None)
    worst = (np.abs(alone - shared).max(axis=0) / np.abs(alone).max(axis=0))[own].max()
    print(f"rank {world.rank} of {world.size}: {worst:.2e} of the largest, expected below {within}")
    assert worst < within
    assert np.array_equal(np.array(again.rows)[:, own], shared[kept:, own])


def relative(values: np.ndarray, reference: np.ndarray) -> float:
    """Largest difference over the largest reference; 0 for histories of nothing."""
    if reference.size == 0:
        return 0.0
    return float(np.abs(values - reference).max() / np.abs(reference).max())


def largest_difference(
    problem: Problem, mesh: LineMesh, *, slackens: bool = False
) -> dict[str, float]:
    """Largest relative difference of each history between one rank and all, on all ranks.

    Fails if no dropper ``slackens`` where one is to.
    """
    alone = on_one(lambda comm: histories(comm, problem, mesh))
    assert not slackens or (alone is not None and (alone["droppers"] <= 0.0).any())
    together = histories(MPI.COMM_WORLD, problem, mesh)
    found = {}
    if together is not None and alone is not None:
        found = {name: relative(together[name], alone[name]) for name in together}
    return dict(MPI.COMM_WORLD.bcast(found, root=0))
