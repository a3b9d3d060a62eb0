"""Motion along the track on one rank and on all ranks, and continued from a checkpoint."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from axial_lines import ALONG, elastic_line
from mpi4py import MPI
from rank_histories import on_one
from small_lines import mesh_of, numerics, problem_of, train

from catenary.solver.problem.ends import AlongTrack, Tensioner
from catenary.solver.statics.line_at_rest import LineAtRest, line_at_rest, line_at_rest_on_all
from catenary.solver.time_loop.march import March
from catenary.solver.time_loop.views.observers import Observer, Stage, StepView

COMM = MPI.COMM_WORLD
AGAIN = 40  # the step to go on from


class Seen(Observer):
    """Keeps contact forces, this rank's dropper forces, motion along the track, a checkpoint."""

    def __init__(self) -> None:
        self.rows: list[tuple[np.ndarray, ...]] = []
        self.checkpoint: dict[str, Any] | None = None

    def start(self, stage: Stage) -> None:
        self.droppers, self.nodes = stage.owned_droppers, stage.owned_nodes

    def next_state(self, step: int) -> int:
        return step + 1

    def observe(self, view: StepView) -> None:
        along = view.node_motion("u", False).copy()
        self.rows.append((view.contact_force.copy(), view.dropper_force.copy(), along))
        found = view.checkpoint()
        if view.step == AGAIN:
            self.checkpoint = found

    def finish(self, outcome: str) -> None:
        assert outcome == "done"

    def channels(self) -> list[np.ndarray]:
        return [np.array(rows) for rows in zip(*self.rows, strict=True)]


def run(comm: MPI.Comm, rest: LineAtRest, start: dict[str, Any] | None = None) -> Seen:
    seen = Seen()
    with March(comm, *rest) as march:
        if start is not None:
            march.restore(start)
        march.run([seen])
    return seen


def test_ranks_and_a_restart_give_the_same_motion_along_the_track() -> None:
    """Leaning droppers that slacken, weights that move, and their stops."""
    line = elastic_line(3)
    assert line.messenger_wire is not None
    line = replace(line, messenger_wire=replace(line.messenger_wire, expansion=0.0))
    ours = train(80.0, 78.0, 88.0, static_force=3000.0, raise_time=0.0, nominal_height=5.5)
    problem = problem_of(
        line,
        ALONG - {"structural_damping"},
        along=AlongTrack(Tensioner(travel=0.3), end=True, warmer=40.0),
        train=ours,
        numerics=numerics(1e-3),
    )
    mesh = mesh_of(line, 2)
    rest = line_at_rest(problem, mesh)
    shared = line_at_rest_on_all(problem, mesh, COMM)
    assert np.array_equal(shared.form.along, rest.form.along)
    assert np.abs(rest.form.leaning(mesh.droppers)).max() > 0.005
    alone, together = on_one(lambda comm: run(comm, rest)), run(COMM, shared)
    again = run(COMM, shared, COMM.bcast(together.checkpoint))
    one, all_, later = alone.channels(), together.channels(), again.channels()
    assert np.abs(one[2]).max() > 1e-5
    assert (one[1] <= 0.0).any(), "a dropper slackens"
    for name, own in ((1, together.droppers), (2, together.nodes)):
        difference = all_[name] - one[name][:, own]
        assert np.abs(difference).max(initial=0.0) < 1e-9 * np.abs(one[name]).max()
    # What is written is read again to the bit; rank 0 has the contact forces.
    for name in range(0 if COMM.rank == 0 else 1, 3):
        assert np.array_equal(later[name], all_[name][-len(later[name]) :])
    assert len(later[0]) == len(all_[0]) - AGAIN
    if COMM.rank == 0:
        assert np.abs(all_[0] - one[0]).max() < 1e-9 * np.abs(one[0]).max()
