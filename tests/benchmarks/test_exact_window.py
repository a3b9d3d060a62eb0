"""What an exact window costs over 60 s on 1000 spans, beside the whole line (`make long-runs`).

Everything above 1e-14 of the largest motion moves. Processor time is counted, of marches in turns
in one process; ``CATENARY_SPANS`` and ``CATENARY_SECONDS`` choose others.
"""

from __future__ import annotations

import os
import time as clock
from dataclasses import replace

import numpy as np
import pytest
from mpi4py import MPI
from scenes import load_scene, mesh_of, problem_of

from catenary.solver.problem.problem import EXACT, OFF, WindowChoice
from catenary.solver.statics.line_at_rest import LineAtRest, line_at_rest
from catenary.solver.time_loop.march import March
from catenary.solver.time_loop.views.observers import Observer, StepView

SPANS = int(os.environ.get("CATENARY_SPANS", "1000"))
SECONDS = float(os.environ.get("CATENARY_SECONDS", "60"))
# Forces are equal to that much of the largest.
SAME = 1e-12


class Forces(Observer):
    """Keeps the contact forces of all steps."""

    def __init__(self) -> None:
        self.blocks: list[np.ndarray] = []

    def next_state(self, step: int) -> int:
        return step - step % 10_000 + 10_000

    def observe(self, view: StepView) -> None:
        self.blocks.append(view.each("contact_force").copy())

    def finish(self, outcome: str) -> None:
        assert outcome == "done", outcome


def marched(rest: LineAtRest, window: WindowChoice, seen: Forces | None) -> float:
    """Processor time of a step [us]."""
    problem = replace(rest.problem, window=window)
    with March(MPI.COMM_SELF, *rest._replace(problem=problem)) as march:
        begin = clock.process_time()
        outcome = march.run([] if seen is None else [seen])
        return 1e6 * (clock.process_time() - begin) / outcome.n_steps


@pytest.mark.timeout(3600)
@pytest.mark.parametrize(
    ("case", "words", "at_most"),
    [
        ("ambrosio2012", ("train.pantographs=[{name='lumped'}]",), 1 / 8),
        (
            "ambrosio2012",
            ("train.pantographs=[{name='lumped'}]", "line.damping.alpha_s=0.00275"),
            1 / 8,
        ),
        ("en50318_2002", (), 1 / 5),
        (
            "en50318_2002",
            (
                "train.pantographs=[{name='reference'},{name='reference',behind_m=200}]",
                "train.start_m=300",
            ),
            1 / 5,
        ),
    ],
    ids=["paper, average", "paper, light", "reference", "reference, two pantographs"],
)
def test_an_exact_window_costs_what_waves_have_reached(
    case: str, words: tuple[str, ...], at_most: float
) -> None:
    scene = load_scene(case, (*words, f"line.n_spans={SPANS}"))
    problem = problem_of(scene)
    end = problem.train.start + SECONDS * problem.train.speed
    problem = replace(problem, train=replace(problem.train, end=end))
    rest = line_at_rest(problem, mesh_of(scene))
    short = replace(problem, train=replace(problem.train, end=problem.train.start + 1.0))
    for mode in (EXACT, OFF):
        # What is read once is read before anything is timed.
        for seen in (None, Forces()):
            marched(rest._replace(problem=short), WindowChoice(mode), seen)
    bare: dict[str, float] = {}
    shown: dict[str, float] = {}
    forces = {EXACT: Forces(), OFF: Forces()}
    for kept in (False, True):
        for mode, seen in forces.items():
            cost = marched(rest, WindowChoice(mode), seen if kept else None)
            (shown if kept else bare)[mode] = cost
    found, expected = (np.concatenate(forces[mode].blocks) for mode in (EXACT, OFF))
    off = float(np.abs(found - expected).max() / np.abs(expected).max())
    print(f"\n{case} {words}: {SPANS} spans, {SECONDS:g} s, forces {off:.1e} of the largest apart")
    for what, costs in (("bare", bare), ("with rows", shown)):
        print(f"  {what:10} whole line {costs[OFF]:6.1f} us a step, exact {costs[EXACT]:6.1f} us, "
              f"1/{costs[OFF] / costs[EXACT]:.1f}")  # fmt: skip
    assert off < SAME
    assert bare[EXACT] < at_most * bare[OFF]
