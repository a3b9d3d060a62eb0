"""Where a step's time goes, by the events that ``-log_view`` shows. Run by ``make bench``."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import pytest
from mpi4py import MPI
from petsc4py import PETSc
from scenes import load_scene, mesh_of, problem_of

from catenary.base.petsc import EVENTS
from catenary.solver.statics.elasticity import elasticity, middle_span
from catenary.solver.statics.form_finding import find_form
from catenary.solver.time_loop.march import March

N_STEPS = 5000


@pytest.fixture
def single_steps() -> Iterator[None]:
    """PETSc's time loop takes steps one by one for its options; this one changes nothing else."""
    PETSc.Options()["march_ts_max_steps"] = 10 * N_STEPS
    yield
    del PETSc.Options()["march_ts_max_steps"]


@pytest.mark.parametrize("pantograph", ["lumped", "seven_body"])
def test_blocks_of_steps(benchmark: Any, pantograph: str) -> None:
    """Nearly all of a march without records is the compiled loop."""
    spent = time_events(benchmark, pantograph)
    assert spent["LineFree"] == 0.0
    assert 0.0 < spent["Steps"] < spent["TSStep"]


@pytest.mark.parametrize("pantograph", ["lumped", "seven_body"])
def test_phases_of_a_step(benchmark: Any, pantograph: str, single_steps: None) -> None:
    """Times of events add up to the step but for what Python does between them."""
    spent = time_events(benchmark, pantograph)
    outer = [name for name in EVENTS if "part of" not in EVENTS[name] and name != "Show"]
    parts = sum(spent[name] for name in outer)
    print(f"  {'between them':15}{spent['TSStep'] - parts:8.1f}")
    assert 0.0 < parts < spent["TSStep"]


def time_events(benchmark: Any, pantograph: str) -> dict[str, float]:
    """Print and return the time of each event in a march [us a step]."""
    train = f'train.pantographs=[{{name="{pantograph}"}}]'
    scene = load_scene("ambrosio2012", ["train.start_m=310", train])
    problem = problem_of(scene)
    model, form = find_form(problem, mesh_of(scene))
    lift = elasticity(model, *middle_span(problem.line))
    train_of = problem.train
    length = N_STEPS * problem.numerics.dt * train_of.speed
    problem = replace(problem, train=replace(train_of, end=train_of.start + length))
    PETSc.Log.begin()
    with March(MPI.COMM_SELF, problem, model, form, lift) as march:
        names = ("TSStep", *EVENTS)
        before = {name: PETSc.Log.Event(name).getPerfInfo()["time"] for name in names}
        benchmark.pedantic(lambda: march.run([]), rounds=1)
        spent = {
            name: 1e6 * (PETSc.Log.Event(name).getPerfInfo()["time"] - before[name]) / N_STEPS
            for name in names
        }
    print(f"\n\nambrosio2012, {pantograph}, one rank, us a step with logging on")
    for name, cost in spent.items():
        print(f"  {name:15}{cost:8.1f}   {EVENTS.get(name, '')}")
    benchmark.extra_info.update(spent)
    return spent
