"""Lines of all topologies, twin wires and an overlap among them, on one rank and on all.

Run by ``mpirun -n N python -m mpi4py -m pytest tests/mpi``. Trains cross the middle of each line,
where two ranks meet; in the overlap the force passes from one contact wire to the other there.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from mpi4py import MPI
from rank_histories import largest_difference, relative
from scenes import load_scene, mesh_of, problem_of

from catenary.base.parallel import on_root
from catenary.meshgen.mesh import LineMesh
from catenary.solver.problem.problem import Problem, steps_of
from catenary.solver.statics.line_at_rest import line_at_rest_on_all
from catenary.solver.time_loop.march import March
from catenary.solver.time_loop.views.observers import Observer, StepView

# As in `test_same_answers`.
TOLERANCE = 1e-9
HALF = 10.0  # of the way, about the middle of the line [m]
APART = "dc_twin, relative motion"
CASES = {
    "re330_stitched": [],
    "shinkansen_compound": [],
    "dc_twin": [],
    APART: ["effects.relative_motion=true"],
    "dc_twin, two messenger wires": ["line.topology=twin_messenger"],
    "tramway": [],
    "overlap": ["line.overlap.first_span=[3,8]", "line.n_spans=12"],
}
N_SPANS = 8


def problem_and_mesh(case: str) -> tuple[Problem, LineMesh]:
    """A short run about the middle of a short line. Collective."""

    def make() -> tuple[Problem, LineMesh]:
        shipped, _, _ = case.partition(",")
        own = load_scene(shipped)
        kind = own.train.pantographs[0].name
        middle = sum(own.line.span_m) / len(own.line.span_m) * N_SPANS / 2
        words = [
            f"line.n_spans={N_SPANS}",
            f"train.pantographs=[{{name='{kind}'}}]",
            f"train.start_m={middle - HALF}",
            f"train.end_m={middle + HALF}",
            "train.raise_time_s=0.05",
            f"evaluation.from_m={middle - 0.5 * HALF}",
            f"evaluation.to_m={middle + 0.5 * HALF}",
            "numerics.dt_s=2e-3",
            *CASES[case],
        ]
        scene = load_scene(shipped, words)
        return problem_of(scene), mesh_of(scene)

    return on_root(MPI.COMM_WORLD, make)


@pytest.mark.parametrize("case", CASES)
def test_lines_of_all_topologies_give_the_answer_of_one_rank(case: str) -> None:
    problem, mesh = problem_and_mesh(case)
    found = largest_difference(problem, mesh)
    if MPI.COMM_WORLD.rank == 0:
        print(f"{MPI.COMM_WORLD.size} ranks, {case}: {found}, expected below {TOLERANCE}")
    assert set(found) == {"force", "arms", "droppers"}
    assert max(found.values()) < TOLERANCE


class Passing(Observer):
    """Keeps the force on each contact wire, and the state at a step."""

    def __init__(self, step: int) -> None:
        self._step = step
        self.forces: list[np.ndarray] = []
        self.state: dict[str, Any] | None = None

    def next_state(self, step: int) -> int:
        return step + 1

    def observe(self, view: StepView) -> None:
        self.forces.append(view.contact_wire_force.copy())
        if view.step == self._step:
            self.state = view.checkpoint()

    def finish(self, outcome: str) -> None:
        assert outcome == "done"


@pytest.mark.parametrize("case", ["dc_twin", APART, "overlap"])
def test_a_run_over_several_contact_wires_goes_on_from_a_state(case: str) -> None:
    """From the middle of the run, on all ranks and on one, with the forces of the whole run."""
    problem, mesh = problem_and_mesh(case)
    comm, half = MPI.COMM_WORLD, steps_of(problem) // 2
    with March(comm, *line_at_rest_on_all(problem, mesh, comm)) as march:
        whole = Passing(half)
        march.run([whole])
    state = comm.bcast(whole.state, root=0)
    for continuing in (comm, MPI.COMM_SELF):
        rest = line_at_rest_on_all(problem, mesh, continuing)
        with March(continuing, *rest) as march:
            march.restore(state)
            again = Passing(0)
            march.run([again])
        if comm.rank == 0:
            expected, found = np.array(whole.forces[half:]), np.array(again.forces)
            assert found.shape == expected.shape
            assert relative(found, expected) < TOLERANCE
            # Both wires carry within the run: a share that is lost would show.
            assert (expected > 1.0).any(axis=0).all()
