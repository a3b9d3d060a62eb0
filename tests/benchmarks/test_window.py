"""What rows of steps cost where a window moves over a long line. Run by ``make bench``.

Both lines are marched in turns in one process, so that other work on the machine hits both alike.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from measuring import start_march
from small_lines import ac_simple_line, mesh_of, problem_of, train

from catenary.solver.problem.window import BOUNDED, WindowChoice
from catenary.solver.time_loop.march import March
from catenary.solver.time_loop.observers import Stage, StepView

ROUNDS, STEPS, SPEED, START = 4, 1000, 70.0, 330.0
SPANS, AROUND = {"whole line": 25, "window": 1000}, 12.0


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


def march_of(n_spans: int, window: WindowChoice) -> March:
    line = ac_simple_line(n_spans)
    run = train(SPEED, START, START + SPEED * STEPS * 1e-3, raise_time=0.2)
    problem = replace(problem_of(line, train=run), window=window)
    return start_march(problem, mesh_of(line, 2))[0]


def test_rows_of_a_window_cost_what_moves() -> None:
    """A window of 24 spans on 1000 against a line of 25 spans."""
    bounded = WindowChoice(BOUNDED, None, AROUND, AROUND)
    choices = {"whole line": WindowChoice(), "window": bounded}
    best: dict[tuple[str, bool], float] = {}
    for _ in range(ROUNDS):
        for name, window in choices.items():
            for shown in (False, True):
                with march_of(SPANS[name], window) as march:
                    outcome = march.run([Rows()] if shown else [])
                cost = 1e6 * outcome.wall / outcome.n_steps
                best[name, shown] = min(cost, best.get((name, shown), np.inf))
    for (name, shown), cost in best.items():
        rows = "with rows" if shown else "bare"
        print(f"{SPANS[name]:5} spans, {name:10} {rows:10} {cost:6.1f} us a step")
    assert best["window", True] < 3.0 * best["whole line", True]
