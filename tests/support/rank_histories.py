"""Marches on one rank and on all, and how far what they show differs."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple, TypeVar

import numpy as np
from mpi4py import MPI
from scenes import load_scene, mesh_of, problem_of

from catenary.base.parallel import on_root
from catenary.meshgen.mesh import LineMesh
from catenary.solver.problem.problem import Problem
from catenary.solver.statics.line_at_rest import LineAtRest, line_at_rest_on_all
from catenary.solver.time_loop.march import March
from catenary.solver.time_loop.views.channels import CHANNELS
from catenary.solver.time_loop.views.observers import Observer, Stage, StepView

WORLD = MPI.COMM_WORLD
# The parallel solve leaves a relative residual of 1e-16 a step; over some thousand steps of a
# lightly damped line that grows at most in proportion, and 1e-9 leaves room for a run ten times
# as long with droppers that switch at round-off.
TOLERANCE = 1e-9

T = TypeVar("T")


class Shown(NamedTuple):
    """What a march shows of its steps to a rank.

    Attributes
    ----------
    channels : (n_steps, n) by name: all channels that the rank has, forces of contacts on rank 0
        alone; after each tenth step ``motion_NAME`` of an unknown of nodes, ``energies`` [J]
    columns : (n,) which places these are, of channels that ranks share
    states : by step, with which to continue; on all ranks
    """

    channels: dict[str, np.ndarray]
    columns: dict[str, np.ndarray]
    states: dict[int, dict[str, Any]]


class Watching(Observer):
    """Keeps channels of each step, the line's motion and energies now and then, some states."""

    def __init__(self, comm: Any, kept: tuple[int, ...] = ()) -> None:
        self._comm, self._kept = comm, kept
        self._rows: dict[str, list[np.ndarray]] = {}
        self._states: dict[int, dict[str, Any]] = {}

    def start(self, stage: Stage) -> None:
        self._unknowns = stage.unknowns
        self._columns = {f"motion_{name}": stage.owned_nodes for name in stage.unknowns}
        for name, channel in CHANNELS.items():
            if channel.per in stage.places:
                self._columns[name] = stage.places[channel.per][1]

    def next_state(self, step: int) -> int:
        return step + 1

    def observe(self, view: StepView) -> None:
        shown = {
            name: view.row[part]
            for name, part in view.columns.items()
            if self._comm.rank == 0 or name in self._columns
        }
        if view.step % 10 == 0:
            for name in self._unknowns:
                shown[f"motion_{name}"] = view.node_motion(name, False)
            shown["energies"] = np.array(view.energies())
        for name, values in shown.items():
            self._rows.setdefault(name, []).append(values.copy())
        if view.step in self._kept:
            self._states[view.step] = self._comm.bcast(view.checkpoint())

    def finish(self, outcome: str) -> None:
        assert outcome == "done"

    def shown(self) -> Shown:
        """All of it."""
        channels = {name: np.array(rows) for name, rows in self._rows.items()}
        return Shown(channels, self._columns, self._states)


def marched(comm: Any, rest: LineAtRest, *kept: int, since: dict[str, Any] | None = None) -> Shown:
    """What a march shows, from a state or from the start, with states of steps ``kept``.
    Collective."""
    watching = Watching(comm, kept)
    with March(comm, *rest) as march:
        if since is not None:
            march.restore(since)
        march.run([watching])
    return watching.shown()


def on_one(run: Callable[[Any], T]) -> T:
    """What ``run`` returns of a communicator of rank 0 alone, on all ranks. Collective. The others
    sleep until it is done: there may be fewer cores than ranks."""
    return on_root(WORLD, lambda: run(MPI.COMM_SELF), takes_long=True)


def off(comm: Any, shared: Shown, alone: Shown) -> dict[str, float]:
    """Largest difference of each channel over its largest value, on all ranks. Collective.

    Open joints are left out, which are round-off. Histories may begin later than ``alone``.
    """
    found: dict[str, float] = {}
    for name, values in shared.channels.items():
        whole = alone.channels[name]
        expected = whole[len(whole) - len(values) :]
        if name in shared.columns and expected.size:
            expected = expected[:, shared.columns[name]]
        assert values.shape == expected.shape, name
        may_be_nan = name in CHANNELS and CHANNELS[name].may_be_nan
        assert may_be_nan or np.isfinite(whole).all(), name
        scale = np.nanmax(np.abs(whole), initial=0.0)
        if scale > 0.0 and name != "constraint_violation":
            same = np.isnan(values) & np.isnan(expected)
            apart = np.abs(np.where(same, 0.0, values - expected)).max(initial=0.0)
            found[name] = float(apart / scale)
    parts = comm.allgather(found)
    return {name: float(np.max([part.get(name, 0.0) for part in parts])) for name in parts[0]}


def check_off(comm: Any, shared: Shown, alone: Shown, within: float = TOLERANCE) -> None:
    """Fail if any channel differs by more than ``within`` of its largest value. Collective."""
    found = off(comm, shared, alone)
    if comm.rank == 0:
        told = ", ".join(f"{name} {value:.1e}" for name, value in found.items())
        print(f"{comm.size} ranks: {told}; expected below {within}")
    assert all(value < within for value in found.values())


def check_ranks(rest: LineAtRest, *kept: int, within: float = TOLERANCE) -> Shown:
    """What a march on one rank shows, on all ranks. Collective.

    Fails if it differs by more than ``within`` from a march on all ranks, or from what states of
    steps ``kept`` of either are continued to on all; a run that goes on from its own repeats the
    other to the last bit.
    """
    alone = on_one(lambda comm: marched(comm, rest, *kept))
    shared = marched(WORLD, rest, *kept)
    check_off(WORLD, shared, alone, within)
    for step in kept:
        check_off(WORLD, marched(WORLD, rest, since=alone.states[step]), alone, within)
        again = marched(WORLD, rest, since=shared.states[step])
        for name, values in again.channels.items():
            expected = shared.channels[name][-len(values) :]
            assert np.array_equal(values, expected, equal_nan=True), name
    return alone


def scene_on_all(case: str, words: list[str]) -> tuple[Problem, LineMesh]:
    """Problem and mesh of a scene. Collective."""

    def make() -> tuple[Problem, LineMesh]:
        scene = load_scene(case, words)
        return problem_of(scene), mesh_of(scene)

    return on_root(WORLD, make)


def rest_on_all(case: str, words: list[str]) -> LineAtRest:
    """The line of a scene at rest. Collective."""
    return line_at_rest_on_all(*scene_on_all(case, words), WORLD)
