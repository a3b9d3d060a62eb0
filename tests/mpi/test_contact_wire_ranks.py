"""Several contact wires under several strips give the same march on one rank and on all ranks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from contact_wires import STIFFNESS, overlap, problem_on, twins
from mpi4py import MPI
from rank_histories import on_one
from small_lines import EN_PANTOGRAPH, mesh_of, numerics, train

from catenary.mbs.head.strips import Strips
from catenary.solver.model.partition import distribute
from catenary.solver.problem.contact_laws import LinearLaw
from catenary.solver.statics.line_at_rest import LineAtRest, line_at_rest
from catenary.solver.time_loop.march import March
from catenary.solver.time_loop.views.observers import Observer, Stage, StepView

COMM = MPI.COMM_WORLD
WAYS = {
    "implicit": numerics(1e-3, coupling="implicit"),  # type: ignore[arg-type]
    "iterated": numerics(1e-3, coupling="iterated"),  # type: ignore[arg-type]
    "fixed point": numerics(1e-3, "fixed_point"),
    "adapted": numerics(1e-3, adaptive_tolerance=0.5, smallest_dt=2.5e-4),
}


class Seen(Observer):
    """Keeps what rank 0 is shown of the train, and this rank's columns of dropper forces."""

    def __init__(self) -> None:
        self.rows: list[tuple[np.ndarray, ...]] = []

    def start(self, stage: Stage) -> None:
        self.owned = stage.owned_droppers

    def next_state(self, step: int) -> int:
        return step + 1

    def observe(self, view: StepView) -> None:
        train_of = view.contact_force, view.strip_force, view.wire_height
        self.rows.append((*(own.copy() for own in train_of), view.dropper_force.copy()))

    def finish(self, outcome: str) -> None:
        assert outcome == "done"


def run(comm: MPI.Comm, rest: LineAtRest) -> list[np.ndarray]:
    seen = Seen()
    with March(comm, *rest) as march:
        march.run([seen])
    return [np.array(rows) for rows in zip(*seen.rows, strict=True)] + [seen.owned]


@pytest.mark.parametrize("way", list(WAYS))
@pytest.mark.parametrize("name", ["unequal twins", "overlap"])
def test_candidates_of_several_wires_and_strips(name: str, way: str) -> None:
    """Two pantographs of two strips, over all cuts between ranks, with damping in the contacts."""
    line = twins(0.3) if name == "unequal twins" else overlap()
    strips = replace(EN_PANTOGRAPH, strips=Strips(2, 0.6))
    run_of = train(
        90.0, 16.0, 45.0, data=strips, static_force=230.0, behind=(0.0, 9.0), raise_time=0.0,
        nominal_height=5.5,
    )  # fmt: skip
    problem = problem_on(
        line,
        train=replace(run_of, start_below=0.02),
        contact=LinearLaw(STIFFNESS, 60.0),
        numerics=WAYS[way],
    )
    rest = line_at_rest(problem, mesh_of(line, 2))
    cuts = distribute(rest.model, COMM.size, 0).bounds[1:-1]
    assert (np.diff([0, *cuts, rest.model.n_dofs]) > 0).all()
    together, alone = run(COMM, rest), on_one(lambda comm: run(comm, rest))
    force, strip, _, droppers, _ = alone
    assert strip.shape[1] == 4 and (strip > 0.0).any(axis=0).all()
    assert (force == 0.0).any() and (droppers == 0.0).any()
    largest = float(force.max())
    close = (1e-6 if way in ("iterated", "fixed point") else 1e-9) * largest
    if COMM.rank == 0:
        for what, within in ((0, close), (1, close), (2, 1e-9)):
            assert np.abs(together[what] - alone[what]).max() < within
    difference = together[3] - droppers[:, together[4]]
    assert np.abs(difference).max(initial=0.0) < close


@pytest.mark.parametrize("name", ["unequal twins", "overlap"])
def test_heads_start_at_the_same_height_on_all_ranks(name: str) -> None:
    """A height that no scene gives follows from all contact wires, which no rank has alone."""
    line = twins(0.3) if name == "unequal twins" else overlap()
    problem = problem_on(line, train=train(90.0, 20.0, 24.0, raise_time=0.1))
    assert problem.train.placements[0].nominal_height is None
    rest = line_at_rest(problem, mesh_of(line, 2))
    together, alone = run(COMM, rest), on_one(lambda comm: run(comm, rest))
    if COMM.rank == 0:
        assert np.abs(together[0] - alone[0]).max() < 1e-9 * alone[0].max()
