"""What a step costs where a window moves over a long line. Run by ``make bench``.

All lines are marched in turns in one process, so that other work on the machine hits all alike.
Processor time is counted, with all that a march makes on its way.
"""

from __future__ import annotations

import time as clock
from dataclasses import replace

import numpy as np
from mpi4py import MPI

from catenary.cases.run.scene_mesh import mesh_of
from catenary.cases.scene.convert.problem import problem_of
from catenary.cases.scene.load import load_scene
from catenary.solver.problem.problem import Problem
from catenary.solver.statics.line_at_rest import LineAtRest, line_at_rest
from catenary.solver.time_loop.march import March
from catenary.solver.time_loop.views.observers import Stage, StepView

ENERGY_EVERY = 20
ROUNDS, WAY = 4, 600.0
# The paper's line with light damping: the window has 13 spans of its own choice, and a step of a
# line of 25 spans is what its length is compared with.
LIGHT = ("line.damping.alpha_s=0.00275", "evaluation.to_m=700")
WINDOW = "window.mode=bounded"
SHORT = "25 spans, all of it"


def lengths(n_spans: int) -> str:
    """Spans of 50 to 58 m of which no two are alike, but for the five of the transition."""
    drawn = np.random.default_rng(1).permutation(n_spans) / n_spans
    return f"line.span_m={(50.0 + 8.0 * drawn[: n_spans - 5]).round(5).tolist()}"


CONTENDERS = {
    SHORT: (),
    "1000 spans": ("line.n_spans=1000", WINDOW),
    "10 000 spans": ("line.n_spans=10000", WINDOW),
    "1000 spans, no two alike": (
        *("line.n_spans=1000", WINDOW, lengths(1000), "line.dropper.spacing_m=6"),
    ),
}
# A step in terms of that of the short line.
AT_MOST = {"1000 spans": 1.15, "10 000 spans": 1.15, "1000 spans, no two alike": 1.3}


class Rows:
    """Is shown the rows of all steps, in blocks."""

    def start(self, stage: Stage) -> None:
        """Nothing is needed of the stage."""

    def next_state(self, step: int) -> int:
        return step - step % 500 + 500

    def observe_rows(self, first_step: int, times: np.ndarray, rows: np.ndarray) -> None:
        """Nothing is kept."""

    def observe(self, view: StepView) -> None:
        """Nothing is kept."""

    def finish(self, outcome: str) -> None:
        assert outcome == "done", outcome


class Energies(Rows):
    """Takes the energy now and then, too."""

    def next_motion(self, step: int) -> int:
        return step - step % ENERGY_EVERY + ENERGY_EVERY

    def observe(self, view: StepView) -> None:
        self.observe_motion(view)

    def observe_motion(self, view: StepView) -> None:
        if view.step % ENERGY_EVERY == 0:
            view.energies()


WATCHING: dict[str, type[Rows] | None] = {"bare": None, "rows": Rows, "energies": Energies}


def at_rest(words: tuple[str, ...]) -> LineAtRest:
    scene = load_scene("ambrosio2012", [*LIGHT, *words])
    problem = problem_of(scene)
    train = replace(problem.train, end=problem.train.start + WAY)
    shortened: Problem = replace(problem, train=train)
    return line_at_rest(shortened, mesh_of(scene))


def cost(rest: LineAtRest, observer: type[Rows] | None) -> float:
    """Of a step [us]."""
    with March(MPI.COMM_SELF, *rest) as march:
        begin = clock.process_time()
        outcome = march.run([] if observer is None else [observer()])
        return 1e6 * (clock.process_time() - begin) / outcome.n_steps


def test_a_step_with_a_window_costs_what_moves() -> None:
    rests = {name: at_rest(words) for name, words in CONTENDERS.items()}
    best = {(name, kind): np.inf for name in rests for kind in WATCHING}
    for _ in range(ROUNDS):
        for name, kind in best:
            best[name, kind] = min(cost(rests[name], WATCHING[kind]), best[name, kind])
    ratios = {key: found / best[SHORT, key[1]] for key, found in best.items()}
    for (name, kind), found in best.items():
        print(f"{name:26} {kind:10} {found:6.1f} us a step {ratios[name, kind]:5.2f}")
    for name, bound in AT_MOST.items():
        # Rows of a long line are filled once at the start, which this way does not hide.
        assert ratios[name, "bare"] < bound, name
        assert ratios[name, "energies"] < 2.0, name
