"""What lines of other topologies cost: whole marches beside those of like lines without, in turns.

Run by ``make bench``.
"""

from __future__ import annotations

import numpy as np
import pytest
from mpi4py import MPI

from catenary.cases.run.scene_mesh import mesh_of
from catenary.cases.scene.convert.problem import problem_of
from catenary.cases.scene.load import load_scene
from catenary.solver.statics.line_at_rest import line_at_rest
from catenary.solver.time_loop.march import March
from catenary.solver.time_loop.observers import Stage, StepView

# Case, what makes the line without it, and how much dearer it may be. A third wire all along makes
# stations of six unknowns of those of four, 1.8 times as dear; where two sections run side by side
# they have eight, and each strip has two contacts everywhere: 2.0 and 2.5 were measured on a loaded
# machine.
STITCHED, COMPOUND = "line.stitch_wire=", "line.auxiliary_wire="
SIMPLE = "line.topology=simple"
LINES: dict[str, tuple[str, list[str], float]] = {
    "stitched": ("re330_stitched", [SIMPLE, STITCHED], 2.0),
    "compound": ("shinkansen_compound", [SIMPLE, COMPOUND], 3.0),
    "twin": ("dc_twin", [SIMPLE, "line.twin="], 2.5),
    "overlap": ("overlap", ["line.overlap="], 3.0),
}
SHORT = ["numerics.dt_s=1e-3", "train.raise_time_s=0.1"]
ROUNDS = 8


class Timed:
    """A march over some hundred metres that starts again and again from its first state."""

    def __init__(self, case: str, changes: list[str]) -> None:
        scene = load_scene(case, [*SHORT, *changes], shortened=True)
        self._march = March(MPI.COMM_SELF, *line_at_rest(problem_of(scene), mesh_of(scene)))
        self._march.run([self])

    def start(self, stage: Stage) -> None:
        """An observer of the first run, for the state that it starts from."""

    def observe(self, view: StepView) -> None:
        if view.step == 0:
            self._first = view.checkpoint()

    def finish(self, outcome: str) -> None:
        assert outcome == "done"

    def step_cost(self) -> float:
        """Time of a step of one more march [us]."""
        assert self._first is not None
        self._march.restore(self._first)
        outcome = self._march.run([])
        return 1e6 * outcome.wall / outcome.n_steps

    def destroy(self) -> None:
        self._march.destroy()


@pytest.mark.parametrize("name", LINES)
def test_a_topology_costs_what_its_wires_cost(name: str) -> None:
    case, without, most = LINES[name]
    marches = [Timed(case, without), Timed(case, [])]
    least = [np.inf, np.inf]
    for _ in range(ROUNDS):
        for number, march in enumerate(marches):
            least[number] = min(least[number], march.step_cost())
    for march in marches:
        march.destroy()
    ratio = least[1] / least[0]
    print(f"\n{name}: {least[0]:.1f} us a step without, {least[1]:.1f} with, {ratio:.2f} times")
    assert ratio < most
