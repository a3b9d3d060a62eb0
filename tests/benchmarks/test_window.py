"""What a step costs where a window moves over a long line. Run by ``make bench``.

All lines are marched in turns in one process, so that other work on the machine hits all alike.
Processor time is counted, of what is further on the way: with all that a march makes there, without
what its start does once on the whole line, which is told beside it.
"""

from __future__ import annotations

import time as clock
from dataclasses import replace

import numpy as np
import pytest
from mpi4py import MPI
from scenes import load_scene, mesh_of, problem_of

from catenary.solver.problem.problem import Problem
from catenary.solver.statics.line_at_rest import LineAtRest, line_at_rest
from catenary.solver.time_loop.march import March
from catenary.solver.time_loop.views.observers import Observer, StepView

ENERGY_EVERY = 20
# Ways whose difference tells what a step costs [m].
ROUNDS, WAYS = 3, (200.0, 1000.0)
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
# A step in terms of that of the short line. Pieces of unlike spans are made while the train comes,
# which takes a quarter to a third of a step: 1.33 to 1.38 were measured.
AT_MOST = {"1000 spans": 1.15, "10 000 spans": 1.15, "1000 spans, no two alike": 1.3}


class Rows(Observer):
    """Is shown the rows of all steps, in blocks."""

    def next_state(self, step: int) -> int:
        return step - step % 500 + 500

    def observe(self, view: StepView) -> None:
        """Nothing is kept."""

    def finish(self, outcome: str) -> None:
        assert outcome == "done", outcome


class Energies(Rows):
    """Takes the energy now and then, too."""

    def next_motion(self, step: int) -> int:
        return step - step % ENERGY_EVERY + ENERGY_EVERY

    def observe(self, view: StepView) -> None:
        if view.step % ENERGY_EVERY == 0:
            view.energies()


WATCHING: dict[str, type[Rows] | None] = {"bare": None, "rows": Rows, "energies": Energies}


def at_rest(words: tuple[str, ...]) -> LineAtRest:
    scene = load_scene("ambrosio2012", [*LIGHT, *words])
    return line_at_rest(problem_of(scene), mesh_of(scene))


def cost(rest: LineAtRest, observer: type[Rows] | None, way: float) -> tuple[float, int]:
    """Processor time of a march over a way [m], in us, and its steps."""
    train = replace(rest.problem.train, end=rest.problem.train.start + way)
    shortened: Problem = replace(rest.problem, train=train)
    with March(MPI.COMM_SELF, *rest._replace(problem=shortened)) as march:
        begin = clock.process_time()
        outcome = march.run([] if observer is None else [observer()])
        return 1e6 * (clock.process_time() - begin), outcome.n_steps


@pytest.mark.timeout(1800)
def test_a_step_with_a_window_costs_what_moves() -> None:
    rests = {name: at_rest(words) for name, words in CONTENDERS.items()}
    best = {(name, kind): [np.inf, np.inf] for name in rests for kind in WATCHING}
    steps = [0, 0]
    for _ in range(ROUNDS):
        for name, kind in best:
            for number, way in enumerate(WAYS):
                found, steps[number] = cost(rests[name], WATCHING[kind], way)
                best[name, kind][number] = min(found, best[name, kind][number])
    a_step = {key: (far - near) / (steps[1] - steps[0]) for key, (near, far) in best.items()}
    ratios = {key: found / a_step[SHORT, key[1]] for key, found in a_step.items()}
    for (name, kind), found in a_step.items():
        once = best[name, kind][0] - steps[0] * found
        print(f"{name:26} {kind:10} {found:6.1f} us a step {ratios[name, kind]:5.2f}"
              f"{1e-3 * once:9.1f} ms once")  # fmt: skip
    for name, bound in AT_MOST.items():
        assert ratios[name, "bare"] < bound, name
        assert ratios[name, "energies"] < 2.0, name
