"""Stations of many unknowns: right-hand sides by M, sparse blocks."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from axial_lines import ALONG, elastic_line
from measuring import COMM
from small_lines import mesh_of, numerics, problem_of

from catenary.solver.integrators.line_integrator import LineIntegrator, make_line
from catenary.solver.model.loads import ShapeLoad, table
from catenary.solver.model.model import Model
from catenary.solver.model.partition import distribute
from catenary.solver.problem.problem import BOUNDED, EXACT, Damping, Numerics, WindowChoice
from catenary.solver.statics.form_finding import find_form

STEPS = 40
# As in test_lines_in_two_passes; x / s of a right-hand side by M is known to a rounding of itself,
# some 1e-12 of the largest acceleration here.
ROUND_OFF = 1e-11
NEWMARK = numerics(1e-3)
HHT = replace(NEWMARK, integrator="hht", spectral_radius=0.7)


@cache
def model() -> Model:
    problem = problem_of(elastic_line(3), ALONG, damping=Damping(1e-4, 0.0125))
    return find_form(problem, mesh_of(elastic_line(3), 3))[0]


def damped(damping: Damping) -> Model:
    problem = problem_of(elastic_line(3), ALONG, damping=damping)
    return find_form(problem, mesh_of(elastic_line(3), 3))[0]


def line(found: Model, method: Numerics, in_passes: bool = True) -> LineIntegrator:
    return make_line(COMM, found, distribute(found, 1, 0), method, in_passes)


@pytest.mark.parametrize(
    "method", [NEWMARK, pytest.param(HHT, marks=pytest.mark.study)], ids=["newmark", "hht"]
)
def test_right_hand_sides_by_mass_are_those_by_stiffness(
    method: Numerics,
) -> None:
    rng = np.random.default_rng(5)
    free = np.ones(model().n_dofs)
    free[model().constrained] = 0.0
    start = [rng.standard_normal(free.size) * free * scale for scale in (1e-3, 0.1, 10.0)]
    times = np.arange(STEPS) * method.dt
    pulled = np.flatnonzero(free)[::5]
    course = table(times, 30.0 * (np.arange(STEPS) // 3))
    loads = [ShapeLoad(pulled, np.ones(pulled.size), course)]
    states = []
    for in_passes in (True, False):
        made = line(replace(model(), loads=loads), method, in_passes)
        if made.passes is not None:
            assert made.passes.parts.changes.by_mass
        made.start(*start)
        for time in times.tolist():
            made.load_at(time)
            made.free_step()
        states.append({name: values.copy() for name, values in made.state().items()})
        made.destroy()
    for name, values in states[0].items():
        difference = np.abs(values - states[1][name]).max()
        assert difference < ROUND_OFF * np.abs(states[1][name]).max(), name


def test_what_is_not_a_sum_of_mass_and_stiffness_is_multiplied_with_both() -> None:
    made = line(damped(Damping(1e-4, 0.0125, {"contact_wire": (2e-3, 0.3)})), NEWMARK)
    assert made.passes is not None and not made.passes.parts.changes.by_mass
    made.destroy()


@pytest.mark.parametrize("mode", [EXACT, BOUNDED])
def test_a_window_beyond_which_the_line_is_bent_multiplies_with_stiffness(mode: str) -> None:
    moving = replace(model().problem, window=WindowChoice(mode, None, 2, 2))
    made = line(replace(model(), problem=moving), NEWMARK)
    assert made.passes is not None
    assert (made.passes.parts.changes.by_mass != 0.0) == (mode == EXACT)
    made.destroy()
