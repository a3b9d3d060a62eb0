"""Numerical damping of links that are stiff for the step: which have it, and what it adds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from small_lines import WHOLE, en50318_line, mesh_of, numerics, problem_of

from catenary.meshgen.line import DropperKind
from catenary.solver.effects.all_effects import active, simulated
from catenary.solver.effects.shipped.line_effects import NAME, STIFF
from catenary.solver.model.model import Model
from catenary.solver.problem.problem import Damping, Problem
from catenary.solver.problem.watched_links import UPLIFT_STOPS
from catenary.solver.statics.form_finding import find_form

EFFECTS = WHOLE | {NAME}
ALPHA = 1e-4


def stiff(k: float, dt: float, effects: frozenset[str] = EFFECTS, alpha: float = ALPHA) -> Problem:
    line = replace(en50318_line(2), dropper=DropperKind(k, None, 0.0, 0.0, 0.0))
    damping = Damping(alpha, 0.01)
    return problem_of(line, effects, numerics=numerics(dt), damping=damping)


def model_of(problem: Problem) -> Model:
    return find_form(problem, mesh_of(en50318_line(2), 1))[0]


def test_stiff_droppers_get_what_they_lack_of_a_step() -> None:
    problem, dt = stiff(1e6, 1e-3), 1e-3
    laws = simulated(problem)
    assert laws.damping.per_component == {"droppers": (dt, 0.01)}
    assert laws.added_alpha == {"droppers": dt - ALPHA}
    model = model_of(problem)
    assert model.dropper_damping == pytest.approx(np.full(18, dt * 1e6), rel=1e-12)
    assert np.array_equal(model.released_damping, model.dropper_damping)


def test_it_is_released_with_the_spring_where_dampers_are_kept() -> None:
    kept = replace(stiff(1e6, 1e-3), slack_dampers_act=True)
    model = model_of(kept)
    assert model.released_damping == pytest.approx(np.full(18, 9e-4 * 1e6), rel=1e-12)


@pytest.mark.parametrize(
    ("problem", "why"),
    [
        (stiff(0.99 * STIFF * 1e6, 1e-3), "not stiff for the step"),
        (stiff(1e6, 1e-3, alpha=1e-3), "damped by a step already"),
        (stiff(1e6, 1e-3, EFFECTS - {"dropper_slackening"}), "droppers that do not switch"),
        (stiff(1e6, 1e-3, WHOLE), "left out"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_other_lines_have_none_of_it(problem: Problem, why: str) -> None:
    assert NAME not in {effect.name for effect in active(problem)}
    assert simulated(problem).added_alpha == {}
    assert model_of(problem).damping_is_proportional


def test_stiff_stops_have_it_as_well() -> None:
    line = en50318_line(2)
    arm = replace(line.steady_arm, uplift_stop=0.02, stop_stiffness=1e7)
    effects = EFFECTS | {"uplift_stops"}
    problem = problem_of(
        replace(line, steady_arm=arm), effects, damping=Damping(0.0, 0.0), numerics=numerics(1e-3)
    )
    assert simulated(problem).added_alpha == {UPLIFT_STOPS: 1e-3}
