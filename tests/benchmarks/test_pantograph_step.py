"""What a pantograph costs in a step: prediction and advance, and their share of the whole step.

Run by ``make bench``. The whole step is that of the case ``ambrosio2012`` with one pantograph on
one rank, measured in the same process.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from mpi4py import MPI
from scenes import load_scene, mesh_of, problem_of

from catenary.mbs.build import Operation, PantographData, make_pantograph
from catenary.mbs.head.stepping import LateralPath, Stepping
from catenary.mbs.head.strips import Strips, Suspension, Turning
from catenary.mbs.lumped import LumpedData
from catenary.mbs.vehicle import BaseMotion, Irregularity, VehicleMotion
from catenary.solver.statics.elasticity import elasticity, middle_span
from catenary.solver.statics.form_finding import find_form
from catenary.solver.time_loop.march import March

CASE = "ambrosio2012"
N_STEPS, ROUNDS = 3000, 7
# What the step of a pantograph may take on one core, beside a whole step of some 65 us [us].
LIMITS = {"lumped, 2 masses": 5.0, "lumped, 3 masses": 5.0, "seven bodies": 10.0}
_median_us: dict[str, float] = {}

TWO = LumpedData((7.2, 15.0), (4200.0, 50.0), (10.0, 90.0))
THREE = LumpedData((7.5, 9.0, 6.0), (7000.0, 15500.0, 160.0), (45.0, 0.1, 100.0))
PAIR = Strips(2, 0.56, 1.6, Suspension(1.0, 8000.0, 10.0))


@pytest.fixture(scope="module")
def seven_bodies() -> PantographData:
    return problem_of(load_scene(CASE)).train.placements[0].data


@pytest.fixture(scope="module", autouse=True)
def table() -> Iterator[None]:
    """Print the costs when all is measured."""
    yield
    step = _median_us.pop("whole step", 0.0)
    print(f"\n{CASE}, one rank, whole step {step:.0f} us; median of {ROUNDS} rounds\n")
    print(f"{'':36}{'us a step':>10}{'of a step':>11}")
    for name, cost in _median_us.items():
        share = f"{100 * cost / step:9.1f} %" if step else ""
        print(f"{name:36}{cost:10.1f}{share}")


def path(offsets: tuple[float, ...], base: BaseMotion | None = None) -> LateralPath:
    supports = np.arange(0.0, 1400.0, 55.0)
    stagger = tuple(0.2 * (-1) ** i for i in range(supports.size))
    return LateralPath([(supports, stagger)], 100.0, offsets, 80.0, base)


def measure(benchmark: Any, name: str, data: PantographData, rolls: bool, moves: bool) -> None:
    track = (Irregularity("fra_6", 3.0, 100.0, 1),)
    base = BaseMotion(VehicleMotion(track, track), 100.0, 80.0) if moves else None
    lateral = path(data.strips.offsets, base) if rolls else None
    operation = Operation(150.0, 5.0, Stepping(0.5, 1e-3, 0.25, 0.5, lateral, base))
    pantograph = make_pantograph(data, operation)
    force = np.full(len(data.strips.offsets), 150.0 / len(data.strips.offsets))

    def march() -> None:
        for number in range(N_STEPS):
            pantograph.predict(1.0 + 1e-3 * number)
            pantograph.advance(force)

    benchmark.pedantic(march, setup=lambda: pantograph.place(5.0), rounds=ROUNDS, warmup_rounds=1)
    _median_us[name] = 1e6 * benchmark.stats.stats.median / N_STEPS
    benchmark.extra_info["us_per_step"] = _median_us[name]
    assert _median_us[name] < 3 * LIMITS.get(name, 20.0)  # thrice, on a machine that others use


@pytest.mark.parametrize(
    ("name", "data", "rolls"),
    [
        ("lumped, 2 masses", TWO, False),
        ("lumped, 3 masses", THREE, False),
        ("lumped, two strips and roll",
         replace(THREE, strips=PAIR, roll=Turning(2.0, 600.0, 4.0)), True),
    ],
)  # fmt: skip
def test_lumped(benchmark: Any, name: str, data: LumpedData, rolls: bool) -> None:
    measure(benchmark, name, data, rolls, moves=False)


@pytest.mark.parametrize(
    ("name", "strips", "rolls", "moves"),
    [
        ("seven bodies", Strips(), False, False),
        ("seven bodies, two strips and roll", PAIR, True, False),
        ("the same on an irregular track", PAIR, True, True),
    ],
)
def test_seven_bodies(
    benchmark: Any,
    seven_bodies: PantographData,
    name: str,
    strips: Strips,
    rolls: bool,
    moves: bool,
) -> None:
    measure(benchmark, name, replace(seven_bodies, strips=strips), rolls, moves)


def test_whole_step(benchmark: Any) -> None:
    scene = load_scene(CASE)
    problem = problem_of(scene)
    train = problem.train
    end = train.start + N_STEPS * problem.numerics.dt * train.speed
    problem = replace(problem, train=replace(train, end=end))
    model, form = find_form(problem, mesh_of(scene))
    lift = elasticity(model, *middle_span(problem.line))
    marches = []

    def fresh() -> tuple[tuple[March], dict[str, Any]]:
        marches.append(March(MPI.COMM_SELF, problem, model, form, lift))
        return (marches[-1],), {}

    benchmark.pedantic(lambda march: march.run([]), setup=fresh, rounds=3)
    _median_us["whole step"] = 1e6 * benchmark.stats.stats.median / marches[0].n_steps
    for march in marches:
        march.destroy()
