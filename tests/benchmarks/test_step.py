"""What a step costs: against its floor, and against the paper's correction. Run by ``make bench``.

The floor is what no implicit step of this model can do without, measured in the same process: one
solve with the factored operator, the fastest that PETSc or LAPACK offers, and one product with K.
Of many short rounds the fastest tells what the program costs, and the median what else the machine
did; ratios are those of the fastest.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from floor import LIBRARIES
from mpi4py import MPI
from scenes import load_scene, mesh_of, problem_of

from catenary.cases.run.runner import run_case
from catenary.postproc.read.results import Results
from catenary.solver.integrators.line_integrator import LineIntegrator, make_line
from catenary.solver.model.model import Model
from catenary.solver.model.partition import distribute
from catenary.solver.statics.line_at_rest import line_at_rest
from catenary.solver.time_loop.march import March

CASE = "ambrosio2012"
TRAINS = {
    "lumped": '[{name="lumped"}]',
    "multibody": '[{name="seven_body"}]',
    "two multibody": '[{name="seven_body"}, {name="seven_body", behind_m=100}]',
}
N_STEPS = 1000
ROUNDS, RUNS = 20, 5
OWN, PRODUCT = "own solve", "product with K"
# Fastest and median round, us a step.
_found: dict[str, tuple[float, float]] = {}


@pytest.fixture(scope="module")
def at_rest() -> tuple[Any, ...]:
    """Problem, model, equilibrium and elasticity of the case."""
    return rest(TRAINS["lumped"])


def rest(train: str) -> tuple[Any, ...]:
    scene = load_scene(CASE, ["train.start_m=310", f"train.pantographs={train}"])
    return line_at_rest(problem_of(scene), mesh_of(scene))


@pytest.fixture(scope="module", autouse=True)
def table() -> Iterator[None]:
    """Print the ratios when all is measured."""
    yield
    solves = np.array([_found[name] for name in LIBRARIES])
    floor = solves.min(axis=0) + _found[PRODUCT]
    parts = (*LIBRARIES, OWN, PRODUCT, "floor")
    print(f"\n{CASE}, one rank, fastest and median of {ROUNDS} rounds of {N_STEPS} steps\n")
    print(f"{'':44}{'us a step':>10}{'median':>9}{'x floor':>9}{'x real time':>13}{'median':>9}")
    dt = load_scene(CASE).numerics.dt_s
    for name, (best, half) in (*_found.items(), ("floor", floor)):
        line = f"{name:44}{best:10.1f}{half:9.1f}{best / floor[0]:9.2f}"
        print(line if name in parts else line + f"{1e6 * dt / best:13.1f}{1e6 * dt / half:9.1f}")


def keep(name: str, benchmark: Any, per_call: int) -> None:
    """Store a benchmark's costs per step and add them to the JSON."""
    stats = benchmark.stats.stats
    _found[name] = 1e6 * stats.min / per_call, 1e6 * stats.median / per_call
    benchmark.extra_info["us_per_step"], benchmark.extra_info["us_half"] = _found[name]


def keep_walls(name: str, benchmark: Any, walls: list[float]) -> None:
    """Store the costs of rounds [us a step] and add them to the JSON."""
    _found[name] = min(walls), float(np.median(walls))
    benchmark.extra_info["us_per_step"], benchmark.extra_info["us_half"] = _found[name]


PARTS: dict[str, Callable[[LineIntegrator, Model], Callable]] = {
    **LIBRARIES,
    OWN: lambda line, model: line.solve,
    PRODUCT: lambda line, model: line.internal_forces,
}


@pytest.mark.parametrize("part", PARTS)
def test_parts_of_the_floor(benchmark: Any, at_rest: tuple[Any, ...], part: str) -> None:
    problem, model, _, _ = at_rest
    line = make_line(MPI.COMM_SELF, model, distribute(model, 1, 0), problem.numerics)
    call = PARTS[part](line, model)

    def repeat() -> None:
        for _ in range(N_STEPS):
            call()

    benchmark.pedantic(repeat, rounds=ROUNDS, warmup_rounds=1)
    line.destroy()
    keep(part, benchmark, N_STEPS)


@pytest.mark.parametrize("pantographs", TRAINS)
def test_step(benchmark: Any, pantographs: str) -> None:
    time_march(benchmark, rest(TRAINS[pantographs]), pantographs, "one_solve")


def test_the_paper_s_correction(benchmark: Any, at_rest: tuple[Any, ...]) -> None:
    time_march(benchmark, at_rest, "lumped, fixed_point", "fixed_point")


def time_march(benchmark: Any, at_rest: tuple[Any, ...], name: str, scheme: str) -> None:
    """Time steps of a march without records, in the blocks in which it takes them."""
    problem, model, form, lift = at_rest
    train = problem.train
    length = N_STEPS * problem.numerics.dt * train.speed
    problem = replace(
        problem,
        train=replace(train, end=train.start + length),
        numerics=replace(problem.numerics, scheme=scheme),
    )
    walls: list[float] = []

    def march_once() -> None:
        with March(MPI.COMM_SELF, problem, model, form, lift) as march:
            outcome = march.run([])
        walls.append(1e6 * outcome.wall / outcome.n_steps)

    benchmark.pedantic(march_once, rounds=ROUNDS)
    keep_walls(name, benchmark, walls)


@pytest.mark.parametrize("pantographs", TRAINS)
def test_a_run_with_all_records(benchmark: Any, pantographs: str, tmp_path: Path) -> None:
    """Steps of whole runs from Python, every channel at each step, flushes and snapshots included;
    set-up and report are not."""
    train = f"train.pantographs={TRAINS[pantographs]}"
    scene = load_scene(CASE, ["train.start_m=310", train])
    walls: list[float] = []

    def run_once() -> None:
        # Each in a folder of its own: to take the place of an earlier file costs what it holds.
        out = tmp_path / str(len(walls))
        run_case(scene, out, MPI.COMM_SELF, only_summary=True)
        with Results(out) as results:
            walls.append(1e6 * results.attributes["march_wall_s"] / results.n_steps)

    benchmark.pedantic(run_once, rounds=RUNS)
    keep_walls(f"{pantographs}, records on the way", benchmark, walls)
