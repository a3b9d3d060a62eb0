"""What records of steps cost where a window moves over a long line. Run by ``make bench``.

Both lines are marched in turns in one process, so that other work on the machine hits both alike.
Processor time is counted.
"""

from __future__ import annotations

import time as clock
from dataclasses import replace

import numpy as np
from measuring import start_march
from small_lines import ac_simple_line, mesh_of, problem_of, train

from catenary.solver.problem.window import BOUNDED, WindowChoice
from catenary.solver.time_loop.march import March
from catenary.solver.time_loop.observers import Stage, StepView

ENERGY_EVERY = 20
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


class Energies(Rows):
    """Takes the energy now and then, too."""

    def next_motion(self, step: int) -> int:
        return step - step % ENERGY_EVERY + ENERGY_EVERY

    def observe(self, view: StepView) -> None:
        self.observe_motion(view)

    def observe_motion(self, view: StepView) -> None:
        if view.step % ENERGY_EVERY == 0:
            view.energies()


def march_of(n_spans: int, window: WindowChoice) -> March:
    line = ac_simple_line(n_spans)
    run = train(SPEED, START, START + SPEED * STEPS * 1e-3, raise_time=0.2)
    problem = replace(problem_of(line, train=run), window=window)
    return start_march(problem, mesh_of(line, 2))[0]


def test_records_of_a_window_cost_what_moves() -> None:
    """A window of 24 spans on 1000 against a line of 25 spans."""
    bounded = WindowChoice(BOUNDED, None, AROUND, AROUND)
    choices = {"whole line": WindowChoice(), "window": bounded}
    watching: dict[str, type[Rows] | None] = {"bare": None, "rows": Rows, "energies": Energies}
    best: dict[tuple[str, str], float] = {}
    for _ in range(ROUNDS):
        for name, window in choices.items():
            for kind, observer in watching.items():
                with march_of(SPANS[name], window) as march:
                    begin = clock.process_time()
                    outcome = march.run([] if observer is None else [observer()])
                    cost = 1e6 * (clock.process_time() - begin) / outcome.n_steps
                best[name, kind] = min(cost, best.get((name, kind), np.inf))
    for (name, kind), cost in best.items():
        print(f"{SPANS[name]:5} spans, {name:10} {kind:10} {cost:6.1f} us a step")
    # The line's rows are filled once at the start, which a thousand steps do not hide.
    assert best["window", "rows"] < 2.0 * best["whole line", "rows"]
    assert best["window", "energies"] < 2.0 * best["whole line", "energies"]
