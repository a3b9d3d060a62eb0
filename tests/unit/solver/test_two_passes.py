"""Free steps in two passes against prediction, product, solve and correction, one by one."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from axial_lines import ALONG, elastic_line
from measuring import COMM
from small_lines import WHOLE, en50318_line, mesh_of, numerics, problem_of

from catenary.solver.integrators.line_integrator import LineIntegrator, make_line
from catenary.solver.model.loads import Load, ShapeLoad, table
from catenary.solver.model.model import Model
from catenary.solver.model.partition import distribute
from catenary.solver.problem.problem import BOUNDED, EXACT, Damping, Numerics, WindowChoice
from catenary.solver.statics.form_finding import find_form

# --- free steps in two passes against prediction, product, solve and correction, one by one -------


STEPS = 40
# Round-off of a step, which 40 steps add up; forces of accelerations differ most.
ROUND_OFF = 1e-11
NEWMARK = numerics(1e-3)
HHT = replace(NEWMARK, integrator="hht", spectral_radius=0.7)
ALPHA = replace(NEWMARK, integrator="generalized_alpha", spectral_radius=0.8)
ONE = Damping(1e-4, 0.0125)
OF_CONTACT_WIRE = Damping(1e-4, 0.0125, {"contact_wire": (2e-3, 0.3)})
OF_COMPONENTS = Damping(1e-4, 0.0125, {"contact_wire": (2e-3, 0.3), "droppers": (1e-2, 0.0)})


@cache
def model(by_component: bool) -> Model:
    damping = OF_COMPONENTS if by_component else ONE
    problem = problem_of(en50318_line(3), WHOLE, damping=damping)
    return find_form(problem, mesh_of(en50318_line(3), 3))[0]


def line(found: Model, method: Numerics, in_passes: bool) -> LineIntegrator:
    made = make_line(COMM, found, distribute(found, 1, 0), method, in_passes)
    assert (made.passes is not None) is in_passes
    return made


def compare_ways(found: Model, method: Numerics, start: list[np.ndarray]) -> None:
    """States after all steps, in two passes and one by one."""
    states = []
    for in_passes in (True, False):
        made = line(found, method, in_passes)
        made.start(*start)
        for number in range(STEPS):
            made.load_at(number * method.dt)
            made.free_step()
        states.append({name: values.copy() for name, values in made.state().items()})
        made.destroy()
    for name, values in states[0].items():
        difference = np.abs(values - states[1][name]).max()
        assert difference < ROUND_OFF * np.abs(states[1][name]).max(), name


def pulses(free: np.ndarray, method: Numerics) -> ShapeLoad:
    """A load on each fifth of the free unknowns that grows every three steps."""
    pulled = np.flatnonzero(free)[::5]
    course = table(np.arange(STEPS) * method.dt, 30.0 * (np.arange(STEPS) // 3))
    return ShapeLoad(pulled, np.ones(pulled.size), course)


@pytest.mark.parametrize("loaded", [False, True])
@pytest.mark.parametrize("lossy", [False, True])
@pytest.mark.parametrize("by_component", [False, True])
@pytest.mark.parametrize("method", [NEWMARK, HHT, ALPHA], ids=lambda method: method.integrator)
def test_two_passes_take_the_steps_of_their_parts(
    method: Numerics, by_component: bool, lossy: bool, loaded: bool
) -> None:
    found = model(by_component)
    rng = np.random.default_rng(5)
    free = np.ones(found.n_dofs)
    free[found.constrained] = 0.0
    start = [rng.standard_normal(found.n_dofs) * free * scale for scale in (1e-3, 0.1, 10.0)]
    loads: list[Load] = []
    if lossy:
        loads.append(ShapeLoad(np.arange(found.n_dofs), 50.0 * rng.standard_normal(found.n_dofs)))
    if loaded:
        loads.append(pulses(free, method))
    compare_ways(replace(found, loads=loads), method, start)


@pytest.mark.parametrize(
    ("method", "by_component"), [(NEWMARK, True), (HHT, False), (ALPHA, False), (HHT, True)]
)
def test_a_line_kept_ahead_goes_on_bit_for_bit(method: Numerics, by_component: bool) -> None:
    found = model(by_component)
    rng = np.random.default_rng(6)
    free = np.ones(found.n_dofs)
    free[found.constrained] = 0.0
    one, other = (line(found, method, True) for _ in range(2))
    one.start(*(rng.standard_normal(found.n_dofs) * free for _ in range(3)))
    for _ in range(5):
        one.free_step()
    other.restore({name: give().copy() for name, give in one.exact_state().items()})
    for made in (one, other):
        for _ in range(5):
            made.free_step()
    for name, give in one.exact_state().items():
        assert np.array_equal(give(), other.exact_state()[name]()), name
    one.destroy()
    other.destroy()


# --- stations of many unknowns --------------------------------------------------------------------


@cache
def elastic_model(by_component: bool = False) -> Model:
    damping = OF_CONTACT_WIRE if by_component else ONE
    problem = problem_of(elastic_line(3), ALONG, damping=damping)
    return find_form(problem, mesh_of(elastic_line(3), 3))[0]


@pytest.mark.parametrize(
    "method", [NEWMARK, pytest.param(HHT, marks=pytest.mark.study)], ids=["newmark", "hht"]
)
def test_right_hand_sides_by_mass_are_those_by_stiffness(method: Numerics) -> None:
    """x / s by M is known to a rounding of itself, some 1e-12 of the largest acceleration here."""
    rng = np.random.default_rng(5)
    free = np.ones(elastic_model().n_dofs)
    free[elastic_model().constrained] = 0.0
    start = [rng.standard_normal(free.size) * free * scale for scale in (1e-3, 0.1, 10.0)]
    found = replace(elastic_model(), loads=[pulses(free, method)])
    made = line(found, method, True)
    assert made.passes is not None and made.passes.parts.changes.by_mass
    made.destroy()
    compare_ways(found, method, start)


def test_what_is_not_a_sum_of_mass_and_stiffness_is_multiplied_with_both() -> None:
    made = line(elastic_model(by_component=True), NEWMARK, True)
    assert made.passes is not None and not made.passes.parts.changes.by_mass
    made.destroy()


@pytest.mark.parametrize("mode", [EXACT, BOUNDED])
def test_a_window_beyond_which_the_line_is_bent_multiplies_with_stiffness(mode: str) -> None:
    moving = replace(elastic_model().problem, window=WindowChoice(mode, None, 2, 2))
    made = line(replace(elastic_model(), problem=moving), NEWMARK, True)
    assert made.passes is not None
    assert (made.passes.parts.changes.by_mass != 0.0) == (mode == EXACT)
    made.destroy()
