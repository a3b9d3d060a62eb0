"""What observers of every step cost beside a march that nobody watches, in turns in one process."""

from __future__ import annotations

import time
from types import SimpleNamespace
from typing import Any

import pytest
from mpi4py import MPI
from scenes import load_scene, mesh_of, problem_of

from catenary.solver.statics.line_at_rest import line_at_rest
from catenary.solver.time_loop import march
from catenary.solver.time_loop.views.observers import NEVER, Observer, StepView

SCENE = ("ambrosio2012", ["train.start_m=310", 'train.pantographs=[{name="lumped"}]'])
# In terms of a march without observers: 1.1 and 3 were measured.
AT_MOST = {"rows": 1.3, "states": 4.0}


class Rows(Observer):
    """Looks at the force of every step in Python, of steps that come in blocks."""

    most = 0.0

    def next_state(self, step: int) -> int:
        return NEVER

    def observe(self, view: StepView) -> None:
        for force in view.each("contact_force"):
            self.most = max(self.most, force[0])


class States(Rows):
    """The same, with the state of every step at hand."""

    def next_state(self, step: int) -> int:
        return step + 1


def test_an_observer_of_every_step(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = load_scene(*SCENE)
    rest: Any = line_at_rest(problem_of(scene), mesh_of(scene))
    clock = SimpleNamespace(perf_counter=time.thread_time, process_time=time.process_time)
    monkeypatch.setattr(march, "clock", clock)
    observers: dict[str, list[Observer]] = {"none": [], "rows": [Rows()], "states": [States()]}
    best = dict.fromkeys(observers, float("inf"))
    for _ in range(5):
        for name, watching in observers.items():
            with march.March(MPI.COMM_SELF, *rest) as run:
                outcome = run.run(watching)
            best[name] = min(best[name], 1e6 * outcome.wall / outcome.n_steps)
    ratios = {name: cost / best["none"] for name, cost in best.items()}
    print({name: f"{best[name]:.1f} us, {ratio:.2f}" for name, ratio in ratios.items()})
    assert observers["rows"][0].most == observers["states"][0].most > 0.0  # type: ignore[attr-defined]
    assert all(ratios[name] < most for name, most in AT_MOST.items())
