"""Processor time of a step: bare, with rows filled, with all records; in turns, least of ROUNDS.

    .venv/bin/python tests/benchmarks/drivers/record_cost.py [ROUNDS]

The march's own thread is timed, so that a machine in use disturbs little: read the ratios.
"""

from __future__ import annotations

import shutil
import sys
import tempfile
import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from mpi4py import MPI

from catenary.cases.run.runner import run_case
from catenary.cases.run.scene_mesh import mesh_of
from catenary.cases.scene.load import load_scene
from catenary.cases.scene.scene import problem_of
from catenary.solver.statics.line_at_rest import line_at_rest
from catenary.solver.time_loop import march
from catenary.solver.time_loop.views.observers import NEVER, Observer, StepView

SCENE = ("ambrosio2012", ["train.start_m=310", 'train.pantographs=[{name="lumped"}]'])


class Rows(Observer):
    """Is shown the rows of all steps and keeps none."""

    def next_state(self, step: int) -> int:
        return NEVER

    def observe(self, view: StepView) -> None:
        """Nothing is kept."""


def main(rounds: int) -> None:
    scene = load_scene(*SCENE)
    rest: Any = line_at_rest(problem_of(scene), mesh_of(scene))
    march.clock = SimpleNamespace(perf_counter=time.thread_time, process_time=time.process_time)
    costs: list[float] = []
    run = march.March.run

    def timed(self: march.March, *arguments: Any) -> march.Outcome:
        outcome = run(self, *arguments)
        costs.append(1e6 * outcome.wall / outcome.n_steps)
        return outcome

    march.March.run = timed
    found: dict[str, list[float]] = {"bare": [], "rows": [], "all records": []}
    for _ in range(rounds):
        for name, own in found.items():
            if name == "all records":
                out = Path(tempfile.mkdtemp())
                run_case(scene, out / "run", MPI.COMM_SELF, only_summary=True)
                shutil.rmtree(out)
            else:
                with march.March(MPI.COMM_SELF, *rest) as one:
                    one.run([Rows()] if name == "rows" else [])
            own.append(costs.pop())
    for name, own in found.items():
        print(f"{name:12}{min(own):8.2f} us a step{min(own) / min(found['bare']):8.2f} of bare")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 12)
