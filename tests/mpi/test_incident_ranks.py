"""Incidents on one rank and all: a dropper at the cut breaks, tension goes, a head is lowered.

Run by ``mpirun -n N python -m mpi4py -m pytest tests/mpi``; on one rank it compares a run with
itself.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from mpi4py import MPI
from rank_histories import on_one
from scenes import load_scene, mesh_of, problem_of
from small_lines import bare_wires
from studies import few

from catenary.base.parallel import on_root
from catenary.mbs.head.stepping import Lowering
from catenary.meshgen.line import DropperPlace
from catenary.meshgen.mesh import CONTACT_WIRE, LineMesh
from catenary.meshgen.topologies.all_topologies import make_line
from catenary.solver.model.partition import distribute
from catenary.solver.problem.defects import DropperBreak, LineIncident, TensionLoss
from catenary.solver.problem.problem import Problem
from catenary.solver.statics.form_finding import find_form
from catenary.solver.statics.line_at_rest import line_at_rest
from catenary.solver.time_loop.march import March
from catenary.solver.time_loop.views.observers import Observer, Stage, StepView

WORLD = MPI.COMM_WORLD
# See test_same_answers.py.
TOLERANCE = 1e-9
# Steps with a checkpoint.
KEPT = (400, 500, 600, 800)
SCENE = (
    # An odd number of spans of nine droppers: one of them stands where two ranks are cut apart.
    "line.n_spans=7",
    "train.start_m=120",
    "train.end_m=200",
    "train.raise_time_s=0.2",
    "evaluation.from_m=150",
    "evaluation.to_m=190",
)


class Watching(Observer):
    """Observer that keeps forces and, of each state, the line's energy; and checkpoints."""

    def __init__(self, kept: tuple[int, ...] = ()) -> None:
        self._kept = kept
        self.checkpoints: dict[int, dict[str, Any]] = {}
        self.rows: list[np.ndarray] = []
        self.droppers: list[np.ndarray] = []

    def start(self, stage: Stage) -> None:
        self.owned = stage.owned_droppers

    def next_state(self, step: int) -> int:
        return step + 1

    def observe(self, view: StepView) -> None:
        energies = view.energies()
        self.rows.append(np.array([*view.contact_force, *energies]))
        self.droppers.append(view.dropper_force.copy())
        if view.step in self._kept:
            self.checkpoints[view.step] = view.checkpoint()

    def finish(self, outcome: str) -> None:
        assert outcome == "done"


def run(
    comm: Any,
    problem: Problem,
    mesh: LineMesh,
    kept: tuple[int, ...] = (),
    since: dict[str, Any] | None = None,
) -> Watching:
    """March on ``comm``, from a checkpoint or from the start. Collective."""
    watching = Watching(kept)
    with March(comm, *line_at_rest(problem, mesh)) as march:
        if since is not None:
            march.restore(since)
        march.run([watching])
    return watching


@pytest.fixture(scope="module")
def case() -> tuple[Problem, LineMesh, float]:
    """A problem, its mesh, and the dropper next to the cut between the first two ranks [m]."""

    def make() -> tuple[Problem, LineMesh, float]:
        scene = load_scene("en50318_2002", SCENE)
        problem, mesh = problem_of(scene), mesh_of(scene)
        model, _ = find_form(problem, mesh)
        x = np.sort(mesh.x(mesh.droppers[:, 1]))
        nodes = mesh.wires[CONTACT_WIRE]
        mine = distribute(model, max(2, WORLD.size), 0).owned(model.dofs(nodes))
        cut = float(mesh.x(nodes[mine]).max())
        nearest = float(x[np.argmin(np.abs(x - cut))])
        if WORLD.size == 2:
            assert abs(nearest - cut) < 1.5  # an element
        return problem, mesh, nearest

    found: tuple[Problem, LineMesh, float] = on_root(WORLD, make)
    return found


def incidents(at_cut: float, share: float = 1.0) -> tuple[LineIncident, ...]:
    """At a ``share`` of the usual times."""
    return (
        DropperBreak(0.5 * share, DropperPlace(at_cut)),
        TensionLoss(0.7 * share, CONTACT_WIRE, 0.8),
        TensionLoss(0.9 * share, "messenger_wire", 0.9),
    )


@pytest.mark.parametrize(
    "scheme", ["one_solve", pytest.param("fixed_point", marks=pytest.mark.study)]
)
def test_all_ranks_give_the_answer_of_one(
    case: tuple[Problem, LineMesh, float], scheme: str
) -> None:
    problem, mesh, at_cut = case
    numerics = replace(problem.numerics, scheme=scheme, eps_d=1e-13, eps_v=1e-10)
    # Sooner than in the run that is continued; a step of the correction takes some ten solves.
    share, way = 0.4, 60.0
    lowering = Lowering(1.1 * share, -60.0, 0.2, 0.3)
    placement = replace(problem.train.placements[0], lowering=lowering)
    train = replace(problem.train, placements=(placement,), end=problem.train.start + way)
    problem = replace(problem, numerics=numerics, incidents=incidents(at_cut, share), train=train)
    alone = on_one(lambda comm: run(comm, problem, mesh))
    together = run(WORLD, problem, mesh)
    parts = WORLD.gather((together.owned, np.array(together.droppers)), root=0)
    found = {}
    if WORLD.rank == 0:
        expected, rows = np.array(alone.rows), np.array(together.rows)
        scale = np.abs(expected).max(axis=0)
        found = dict(
            zip(
                ("force", "kinetic", "elastic"), np.abs(rows - expected).max(axis=0) / scale,
                strict=True,
            )
        )  # fmt: skip
        whole = np.full((len(rows), mesh.droppers.shape[0]), np.nan)
        for numbers, values in parts:
            whole[:, numbers] = values
        droppers = np.array(alone.droppers)
        found["droppers"] = np.abs(whole - droppers).max() / np.abs(droppers).max()
        at = int(np.argmin(np.abs(mesh.x(mesh.droppers[:, 1]) - at_cut)))
        breaks = round(500 * share)
        found["broken carries"] = np.abs(whole[breaks + 1 :, at]).max()
        found["carried before"] = whole[breaks, at]
        gone = rows[round(1100 * share) + 400 :, 0]
        assert gone.size > 10
        found["force after the head has gone"] = np.abs(gone).max()
        print(f"{WORLD.size} ranks, {scheme}: {found}, expected below {TOLERANCE}")
    found = WORLD.bcast(found, root=0)
    assert found.pop("carried before") > 10.0
    assert found.pop("broken carries") == 0.0
    assert found.pop("force after the head has gone") == 0.0
    assert max(found.values()) < TOLERANCE


@pytest.fixture(scope="module")
def uninterrupted(case: tuple[Problem, LineMesh, float]) -> Watching:
    """A run on one rank with its checkpoints."""
    problem, mesh, at_cut = case
    problem = replace(problem, incidents=incidents(at_cut))
    return on_one(lambda comm: run(comm, problem, mesh, kept=KEPT))


@pytest.mark.parametrize("at", few(KEPT, 500, 800))
def test_a_run_goes_on_with_another_number_of_ranks(
    case: tuple[Problem, LineMesh, float], uninterrupted: Watching, at: int
) -> None:
    """From a checkpoint of one rank, before, at and after incidents."""
    problem, mesh, at_cut = case
    problem, alone = replace(problem, incidents=incidents(at_cut)), uninterrupted
    together = run(WORLD, problem, mesh, since=alone.checkpoints[at])
    apart = 0.0
    if WORLD.rank == 0:
        expected = np.array(alone.rows)[at:]
        apart = float((np.abs(np.array(together.rows) - expected) / np.abs(expected).max(0)).max())
        print(f"{WORLD.size} ranks from step {at}: {apart:.1e}, expected below {TOLERANCE}")
    assert WORLD.bcast(apart, root=0) < TOLERANCE


def test_a_rank_without_any_station_is_legal(case: tuple[Problem, LineMesh, float]) -> None:
    """Two bare wires of one element have two stations: on three ranks one owns nothing."""
    problem, _, _ = case
    length = 60.0
    mesh = LineMesh(
        points=np.array([[0.0, 0.0, 5.0], [length, 0.0, 5.0], [0.0, 0.0, 6.2], [length, 0.0, 6.2]]),
        wires={CONTACT_WIRE: np.array([0, 1]), "messenger_wire": np.array([2, 3])},
        droppers=np.zeros((0, 2), dtype=int),
        steady_arms=np.zeros(0, dtype=int),
        supports=np.zeros(0, dtype=int),
        anchors=np.array([0, 1, 2, 3]),
    )
    line = make_line(bare_wires(length))
    bare = replace(
        problem,
        line=line,
        train=replace(problem.train, start=5.0, end=50.0),
        incidents=(TensionLoss(0.3, CONTACT_WIRE, 0.8),),
    )
    alone, together = on_one(lambda comm: run(comm, bare, mesh)), run(WORLD, bare, mesh)
    apart = lost = 0.0
    if WORLD.rank == 0:
        expected, rows = np.array(alone.rows), np.array(together.rows)
        apart = float((np.abs(rows - expected) / np.abs(expected).max(axis=0)).max())
        sound = np.array(run(MPI.COMM_SELF, replace(bare, incidents=()), mesh).rows)
        lost = float(np.abs(rows[301:, 1] - sound[301:, 1]).max())
    apart, lost = WORLD.bcast((apart, lost), root=0)
    assert lost > 1e-3
    assert apart < TOLERANCE
