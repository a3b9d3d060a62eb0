"""A staggered line with lateral motion is the same line on any number of ranks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from mpi4py import MPI
from rank_histories import on_one
from small_lines import EN_PANTOGRAPH, WHOLE, ac_simple_line, mesh_of, problem_of, train

from catenary.mbs.head.strips import Turning
from catenary.meshgen.line import Curve
from catenary.solver.statics.line_at_rest import line_at_rest_on_all
from catenary.solver.time_loop.march import March
from catenary.solver.time_loop.views.observers import Observer, Stage, StepView

COMM = MPI.COMM_WORLD


class Seen(Observer):
    """Keeps contact forces and lateral positions, on rank 0, and this rank's arm uplifts."""

    def __init__(self) -> None:
        self.rows: list[tuple[np.ndarray, np.ndarray]] = []

    def start(self, stage: Stage) -> None:
        self.owned = stage.owned_arms

    def next_state(self, step: int) -> int:
        return step + 1

    def observe(self, view: StepView) -> None:
        here = np.append(view.contact_force, 1e3 * view.lateral_place)
        self.rows.append((here, view.arm_uplift.copy()))

    def finish(self, outcome: str) -> None:
        assert outcome == "done"


def run(comm: MPI.Comm) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    line = ac_simple_line(4)
    arm = replace(line.steady_arm, inclination=np.deg2rad(10.0))
    line = replace(line, steady_arm=arm, curve=Curve(1 / 3000, 0.05))
    data = replace(EN_PANTOGRAPH, roll=Turning(2.0, 470.0, 60.0))
    going = train(80.0, 70.0, 125.0, static_force=250.0, raise_time=0.1, data=data)
    problem = problem_of(line, WHOLE | {"lateral_motion", "head_roll"}, train=going)
    seen = Seen()
    with March(comm, *line_at_rest_on_all(problem, mesh_of(line, 3), comm)) as march:
        march.run([seen])
    force, uplift = (np.array(rows) for rows in zip(*seen.rows, strict=True))
    return force, uplift, seen.owned


def test_lateral_motion_is_the_same_on_any_number_of_ranks() -> None:
    together, alone = run(COMM), on_one(run)
    assert alone[0].max() > 150.0
    if COMM.rank == 0:
        assert np.abs(together[0] - alone[0]).max() < 1e-9 * alone[0].max()
    difference = together[1] - alone[1][:, together[2]]
    assert np.abs(difference).max(initial=0.0) < 1e-9 * np.abs(alone[1]).max()
