"""Lines of three wires give the same march on one rank and on all ranks, incidents included."""

from __future__ import annotations

import numpy as np
import pytest
from more_wires import AUXILIARY, STITCH, TOPOLOGIES, data_of, further_topologies
from mpi4py import MPI
from rank_histories import on_one
from small_lines import WHOLE, mesh_of, problem_of, train

from catenary.meshgen.line import DropperPlace
from catenary.meshgen.topologies.all_topologies import make_line
from catenary.solver.problem.defects import DropperBreak, TensionLoss
from catenary.solver.statics.line_at_rest import LineAtRest, line_at_rest
from catenary.solver.time_loop.march import March
from catenary.solver.time_loop.views.observers import Observer, Stage, StepView

COMM = MPI.COMM_WORLD
INCIDENTS = frozenset({"dropper_break", "tension_loss"})


class Seen(Observer):
    """Keeps contact forces, on rank 0, and this rank's columns of dropper forces."""

    def __init__(self) -> None:
        self.rows: list[tuple[np.ndarray, np.ndarray]] = []

    def start(self, stage: Stage) -> None:
        self.owned = stage.owned_droppers

    def next_state(self, step: int) -> int:
        return step + 1

    def observe(self, view: StepView) -> None:
        self.rows.append((view.contact_force.copy(), view.dropper_force.copy()))

    def finish(self, outcome: str) -> None:
        assert outcome == "done"


def run(comm: MPI.Comm, rest: LineAtRest) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    seen = Seen()
    with March(comm, *rest) as march:
        march.run([seen])
    force, droppers = (np.array(rows) for rows in zip(*seen.rows, strict=True))
    return force, droppers, seen.owned


@pytest.mark.parametrize("topology", list(TOPOLOGIES))
def test_lines_of_three_wires_march_the_same_on_any_number_of_ranks(topology: str) -> None:
    with further_topologies():
        line = make_line(data_of(topology, 4))
    mast = float(line.support_positions[2])
    first = float(line.droppers_of_span(2)[0])
    wire = AUXILIARY if topology == "compound" else STITCH
    problem = problem_of(
        line,
        WHOLE | INCIDENTS,
        train=train(80.0, mast - 40.0, mast + 20.0, static_force=250.0, raise_time=0.1),
        incidents=(TensionLoss(0.2, wire, 0.8), DropperBreak(0.3, DropperPlace(first))),
    )
    rest = line_at_rest(problem, mesh_of(line, 2))
    together, alone = run(COMM, rest), on_one(lambda comm: run(comm, rest))
    largest = float(alone[1].max())
    assert alone[0].max() > 150.0 and (alone[1][-1] == 0.0).any()
    if COMM.rank == 0:
        assert np.abs(together[0] - alone[0]).max() < 1e-9 * largest
    difference = together[1] - alone[1][:, together[2]]
    assert np.abs(difference).max(initial=0.0) < 1e-9 * largest
