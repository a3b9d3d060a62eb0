"""Each reason for steps one by one: told before a march, in its log and outcome, and what is so."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from measuring import start_march
from small_lines import WHOLE, ac_simple_line, mesh_of, numerics, problem_of, train

from catenary.mbs.head.stepping import Lowering
from catenary.meshgen.mesh import LineMesh
from catenary.solver.integrators import slow_path
from catenary.solver.integrators.slow_path import single_steps_of
from catenary.solver.kernels import native
from catenary.solver.problem.contact_laws import HertzLaw, KinematicLaw, LinearLaw
from catenary.solver.problem.problem import Problem
from catenary.solver.time_loop import march as time_loop
from catenary.solver.time_loop.compiled_steps import CompiledSteps
from catenary.solver.time_loop.march import Outcome
from catenary.solver.time_loop.views import channels
from catenary.solver.time_loop.views.channels import RUN, Channel

LINE = ac_simple_line(4)
SPRING = LinearLaw(5e4, 0.0)


@pytest.fixture(scope="module")
def mesh() -> LineMesh:
    return mesh_of(LINE, 3)


@pytest.fixture
def loops(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[bool]]:
    """Of each part of a march whether its steps are taken in a compiled loop."""
    found: list[bool] = []
    make = time_loop.compiled_steps

    def watched(*arguments: Any) -> Any:
        loop = make(*arguments)
        found.append(loop is not None)
        return loop

    monkeypatch.setattr(time_loop, "compiled_steps", watched)
    monkeypatch.setattr(slow_path, "_logged", set())
    yield found


def problem(law: Any = SPRING, **steps: Any) -> Problem:
    return problem_of(
        LINE,
        WHOLE | {"lowering"},
        contact=law,
        train=train(75.0, 90.0, 91.0, raise_time=0.0),
        numerics=numerics(1e-3, **steps),
    )


def marched(scene: Problem, mesh: LineMesh) -> Outcome:
    march, _ = start_march(scene, mesh)
    with march:
        return march.run([])


def lowered() -> Problem:
    scene = problem()
    placement = replace(scene.train.placements[0], lowering=Lowering(0.01, -60.0, 0.2, 0.4))
    return replace(scene, train=replace(scene.train, placements=(placement,)))


@pytest.mark.parametrize(
    ("scene", "word"),
    [
        (problem(adaptive_tolerance=5.0), "numerics.adaptive_tolerance_N"),
        (problem(coupling="iterated"), "iterated"),
    ],
)
def test_a_reason_is_told_where_kernels_do_not_take_steps_alone(
    scene: Problem,
    word: str,
    mesh: LineMesh,
    loops: list[bool],
    caplog: pytest.LogCaptureFixture,
) -> None:
    told = single_steps_of(scene)
    assert told is not None and word in told.reason and told.factor > 1.0
    with caplog.at_level(logging.WARNING):
        outcomes = [marched(scene, mesh) for _ in range(2)]
    assert [outcome.slow_path for outcome in outcomes] == 2 * [str(told)]
    # Once for both, as for the runs of a sweep.
    assert [record.message for record in caplog.records] == [str(told)]
    assert loops == [False, False]


@pytest.mark.parametrize(
    "scene",
    [problem(), problem(KinematicLaw()), problem(HertzLaw(1e6, 1.5, 0.0, 0.1)), lowered()],
)
def test_nothing_is_told_of_steps_in_the_loop(
    scene: Problem, mesh: LineMesh, loops: list[bool], caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.WARNING):
        outcome = marched(scene, mesh)
    assert (outcome.slow_path, loops, caplog.records) == ("", [True], [])


def test_a_channel_that_is_a_function_is_told_by_its_march(
    mesh: LineMesh, loops: list[bool], monkeypatch: pytest.MonkeyPatch
) -> None:
    count = Channel("count", "-", "a count", RUN, lambda now: lambda: np.ones(1))  # type: ignore[arg-type, return-value]
    monkeypatch.setitem(channels.CHANNELS, "count", count)
    scene = problem()
    assert single_steps_of(scene) is None
    assert "a channel is a Python function" in marched(scene, mesh).slow_path
    assert loops == [False]


def test_other_ways_through_a_step_have_reasons_of_their_own() -> None:
    adapted = {"adaptive_tolerance": 5.0}
    assert single_steps_of(problem(scheme="fixed_point", **adapted)) is None
    assert single_steps_of(problem(coupling="explicit", **adapted)) is None


def test_the_reason_that_costs_most_is_told() -> None:
    adapted, both = {"adaptive_tolerance": 5.0}, {"adaptive_tolerance": 5.0, "coupling": "iterated"}
    of_one, of_both = single_steps_of(problem(**adapted)), single_steps_of(problem(**both))
    assert of_one is not None and of_both is not None and "iterated" in of_both.reason
    assert of_both.factor > of_one.factor > 1.0


def test_steps_whose_free_part_others_take_are_refused_as_a_prepared_line(mesh: LineMesh) -> None:
    class Apart(CompiledSteps):
        """Steps as an ensemble takes them."""

        def _made(self, parts: native.StepParts, block: native.Block) -> Any:
            return super()._made(parts._replace(free=None), block)

    march, _ = start_march(problem(), mesh)
    with march, pytest.raises(ValueError, match="these steps are taken by an ensemble"):
        Apart(*march.in_loop(), shows=False).steps().write("nowhere", None)
