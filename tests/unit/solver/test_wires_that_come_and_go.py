"""A line with a third wire in places: steps of every kind against dense matrices."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from measuring import COMM
from small_lines import numerics
from stitched_line import motion, stitched_model

from catenary.solver.integrators.line_integrator import make_line
from catenary.solver.model.loads import ShapeLoad
from catenary.solver.model.matrices import whole_matrix
from catenary.solver.model.model import Model
from catenary.solver.model.partition import distribute
from catenary.solver.problem.integrator_parameters import NEWMARK, integration_of
from catenary.solver.problem.problem import Damping, Numerics

STEPS = 20
# Round-off of 20 steps, relative to the largest number of its kind.
ROUND_OFF = 1e-12
USUAL = numerics(1e-3)
HHT = replace(USUAL, integrator="hht", spectral_radius=0.7)
ONE = Damping(1e-4, 0.0125)
OF_COMPONENTS = Damping(1e-4, 0.0125, {"stitch_wire": (2e-3, 0.3), "droppers": (1e-2, 0.0)})


@cache
def model(by_component: bool) -> Model:
    return stitched_model(3, OF_COMPONENTS if by_component else ONE)


def test_stations_are_as_wide_as_the_wires_that_are_there() -> None:
    numbering = model(False).numbering
    assert numbering.in_stations and numbering.station_types == (tuple(range(4)), tuple(range(6)))
    # Nine metres to either side of two supports, and a station more at both ends of each piece.
    assert numbering.size < 4.8 * numbering.station_type.size
    assert numbering.missing.size == 2 * 4


def dense_steps(found: Model, method: Numerics, load: np.ndarray) -> list[np.ndarray]:
    """Displacement, velocity and balancing acceleration after ``STEPS`` steps."""
    dt, beta, gamma, kept, shared = method.dt, method.beta, method.gamma, 0.0, 0.0
    if method.integrator != NEWMARK:
        chosen = integration_of(method.integrator, method.spectral_radius)
        beta, gamma, kept, shared = chosen
    ratio = (1.0 - shared) / (1.0 - kept)
    m, k, c = (whole_matrix(found, *np.eye(3)[number]).toarray() for number in range(3))
    m[found.constrained, found.constrained] = 1.0
    sigma, tau = ratio * beta * dt**2, ratio * gamma * dt
    inverse = np.linalg.inv(m + tau * c + sigma * k)
    d, v, b = motion(found, 5)
    a = b
    for _ in range(STEPS):
        p = (shared * b - kept * a) / (1.0 - kept)
        d = d + dt * v + dt**2 * ((0.5 - beta) * a + beta * p)
        v = v + dt * ((1.0 - gamma) * a + gamma * p)
        b = inverse @ (load - k @ d - c @ v)
        a, d, v = p + ratio * b, d + sigma * b, v + tau * b
    return [d, v, b]


@pytest.mark.parametrize("in_passes", [True, False])
@pytest.mark.parametrize(
    ("method", "by_component"),
    [(USUAL, False), (USUAL, True), pytest.param(HHT, False, marks=pytest.mark.study)],
    ids=["newmark", "damping by component", "hht"],
)
def test_steps_are_those_of_dense_matrices(
    method: Numerics, by_component: bool, in_passes: bool
) -> None:
    load = 50.0 * motion(model(by_component), 2)[1]
    forces = ShapeLoad(np.arange(load.size), load)
    found = replace(model(by_component), loads=[forces])
    made = make_line(COMM, found, distribute(found, 1, 0), method, in_passes)
    assert (made.passes is not None) is in_passes
    assert made.operators.by_stations(False) is not None
    made.start(*motion(found, 5))
    for _ in range(STEPS):
        made.load_at(0.0)
        made.free_step()
    state = made.state()
    expected = dense_steps(found, method, load)
    for name, values in zip(("displacement", "velocity", "acceleration"), expected, strict=True):
        assert np.abs(state[name] - values).max() < ROUND_OFF * np.abs(values).max(), name
    made.destroy()
