"""Loads in time against closed forms: a shape times a function of time, and a travelling field.

The train is there but does not touch: its contact stiffness is zero. Far from both ends, and until
waves come from there, a string knows nothing of its supports.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from measuring import check, march, print_table, registered
from small_lines import (
    BARE,
    EN_CONTACT_WIRE,
    FREE_MASS,
    bare_wires,
    mesh_of,
    numerics,
    problem_of,
    train,
)
from ts_alpha2 import TS_ALPHA2

from catenary.meshgen.mesh import CONTACT_WIRE
from catenary.solver.effects.effect import Effect
from catenary.solver.model.builder import ModelBuilder
from catenary.solver.model.loads import FieldLoad, ShapeLoad, constant, harmonics, table
from catenary.solver.problem.contact_laws import LinearLaw
from catenary.solver.wind import forces_along

DENSITY, SPEED = EN_CONTACT_WIRE.mass_per_length, EN_CONTACT_WIRE.wave_speed
PLANE = ("w", "theta_y")
LOAD = 10.0  # [N/m]
LENGTH = 400.0
# Waves from the ends have come 61 m then, those that the mesh makes too fast some more.
DURATION = 0.5
CLEAR = 60.0  # [m] to both sides of the middle
Build = Callable[[ModelBuilder], None]


def deflection(
    build: Build, dt: float, n_elements: int = 200, **changes: object
) -> tuple[np.ndarray, np.ndarray]:
    """Nodes of the contact wire [m] and their deflection at the end [m], without bending."""
    wire = replace(EN_CONTACT_WIRE, bending_stiffness=1e-3)
    line = bare_wires(LENGTH, contact_wire=wire)
    mesh = mesh_of(line, n_elements)
    creep = train(1.0, 1.0, 1.0 + DURATION + 0.5 * dt, data=FREE_MASS, static_force=0.0)
    problem = problem_of(
        line,
        BARE | {"load"},
        train=creep,
        contact=LinearLaw(0.0, 0.0),
        numerics=numerics(dt, **changes),  # type: ignore[arg-type]
    )
    with registered(Effect("load", "a load", "a load", "test", False, build=build)):
        history = march(problem, mesh, lambda view: (view.time, view.node_motion))
    time, motion = history.watched[-1]
    assert abs(time - DURATION) < 1e-9
    nodes = mesh.wires[CONTACT_WIRE]
    return mesh.x(nodes), motion("w", False)[np.searchsorted(history.stage.owned_nodes, nodes)]


def uniform(course: object) -> Build:
    """A load per length on all of the contact wire times a function of time."""

    def build(builder: ModelBuilder) -> None:
        unknowns, weights = forces_along(builder.model, CONTACT_WIRE, PLANE)
        forces = weights @ np.full(weights.shape[1], LOAD)
        builder.add_load(ShapeLoad(unknowns, forces, course))  # type: ignore[arg-type]

    return build


@pytest.mark.parametrize("scheme", ["one_solve", "fixed_point", "hht"])
def test_a_constant_load_accelerates_a_string_from_its_first_instant(scheme: str) -> None:
    """w = q t^2 / (2 rho): average acceleration is exact where accelerations do not change.

    Without the acceleration at the start w would lack q dt t / (2 rho), 0.4 % here.
    """
    changes: dict[str, object] = {"scheme": scheme}
    if scheme == "hht":
        changes = {"integrator": "hht", "spectral_radius": 0.8}
    x, w = deflection(uniform(constant()), 2e-3, **changes)
    middle = np.abs(x - 0.5 * LENGTH) < CLEAR
    expected = LOAD * DURATION**2 / (2 * DENSITY)
    # Each of 250 steps rounds a right-hand side of T / h = 1e4 N/m times the deflection.
    check("deflection [m]", w[middle], expected, within=1e-10 * expected)


def test_a_load_that_rises_and_falls_leaves_its_impulse() -> None:
    """rho w = q / 2 (0.4 s) (t - 0.2 s) after a ramp up to 0.2 s and down to 0.4 s: exactly, as
    average acceleration integrates what is linear within steps, and errors of both ramps cancel."""
    x, w = deflection(uniform(table([0.0, 0.2, 0.4], [0.0, 1.0, 0.0])), 10e-3)
    middle = np.abs(x - 0.5 * LENGTH) < CLEAR
    expected = LOAD / DENSITY * 0.2 * (DURATION - 0.2)
    check("deflection [m]", w[middle], expected, within=1e-10 * expected)


def test_a_harmonic_load_follows_its_integrals() -> None:
    """rho w'' = q g(t): of g = m + cos(p t + b), w rho / q = m t^2 / 2 + (cos b - cos(p t + b)) /
    p^2 - t sin(b) / p. The time step's error falls with order 2."""
    p, b, t = 6.0 * np.pi, 0.3, DURATION
    twice = 0.25 * t**2 + (np.cos(b) - np.cos(p * t + b)) / p**2 - t * np.sin(b) / p
    expected = LOAD / DENSITY * twice
    errors, steps = [], [20e-3, 10e-3, 5e-3]
    for dt in steps:
        x, w = deflection(uniform(harmonics([3.0], [1.0], [b], mean=0.5)), dt)
        errors.append(abs(w[np.argmin(np.abs(x - 0.5 * LENGTH))] - expected))
    print(f"deflection {expected:.6f} m")
    observed = print_table("error [m], expected order 2", [f"{dt * 1e3:g} ms" for dt in steps],
                           errors)  # fmt: skip
    # The next term is (p dt)^2 / 12 of the last one, p = 19 1/s.
    check("order", observed[-1], 2, within=(6 * np.pi * steps[1]) ** 2 / 12 + 0.02)


@pytest.mark.parametrize("scheme", ["one_solve", "fixed_point", TS_ALPHA2])
def test_a_harmonic_load_on_one_mode_follows_its_oscillator(scheme: str) -> None:
    """q sin(pi x / L) cos(p t): w = q / rho (cos p t - cos o t) / (o^2 - p^2) sin(pi x / L)."""
    p = 2 * np.pi * 2.0

    def build(builder: ModelBuilder) -> None:
        unknowns, weights = forces_along(builder.model, CONTACT_WIRE, PLANE)
        nodes = builder.mesh.wires[CONTACT_WIRE]
        shape = LOAD * np.sin(np.pi * builder.mesh.x(nodes) / LENGTH)
        builder.add_load(ShapeLoad(unknowns, weights @ shape, harmonics([2.0], [1.0], [0.0])))

    omega = np.pi / LENGTH * SPEED
    size = LOAD / DENSITY * (np.cos(p * DURATION) - np.cos(omega * DURATION)) / (omega**2 - p**2)
    errors, steps = [], [10e-3, 5e-3, 2.5e-3]
    for dt in steps:
        x, w = deflection(build, dt, scheme=scheme)
        errors.append(float(np.abs(w - size * np.sin(np.pi * x / LENGTH)).max()))
    print(f"amplitude {size:.6f} m")
    observed = print_table("largest error [m], expected order 2",
                           [f"{dt * 1e3:g} ms" for dt in steps], errors)  # fmt: skip
    # Loads that are linear along elements of 2 m are wrong by (pi h / L)^2 / 12 of themselves.
    element = (np.pi * 2.0 / LENGTH) ** 2 / 12 * abs(size)
    within = (p * steps[1]) ** 2 / 12 + 2 * element / errors[-1] + 0.05
    check("order", observed[-1], 2, within=within)


def test_a_travelling_field_drives_a_string_as_its_closed_form_says() -> None:
    """q sin(k x - O t) on a string at rest, D = o^2 - O^2, o = c k, away from its ends:

        w = q / (rho D) (sin(k x - O t) - sin(k x) cos(o t) + O / o cos(k x) sin(o t)).

    The field is sampled in points and slices; with the step all are halved together: order 2.
    """
    k, travels = 2 * np.pi / 40.0, 75.0
    forced, own = k * travels, k * SPEED

    def sampled(spacing: float, interval: float) -> Build:
        def build(builder: ModelBuilder) -> None:
            points = np.arange(0.0, LENGTH + 0.5 * spacing, spacing)
            unknowns, weights = forces_along(builder.model, CONTACT_WIRE, PLANE, points)

            def fill(first: int, part: slice, slices: np.ndarray) -> None:
                times = interval * (first + np.arange(slices.shape[0]))
                slices[:] = LOAD * np.sin(k * points[part] - forced * times[:, None])

            builder.add_load(FieldLoad(unknowns, weights, interval, fill))

        return build

    errors, halvings = [], [1, 2, 4]
    for n in halvings:
        x, w = deflection(sampled(4.0 / n, 20e-3 / n), 10e-3 / n, n_elements=200 * n)
        middle = np.abs(x - 0.5 * LENGTH) < CLEAR
        at, t = x[middle], DURATION
        shape = np.sin(k * at - forced * t) - np.sin(k * at) * np.cos(own * t)
        shape += forced / own * np.cos(k * at) * np.sin(own * t)
        exact = LOAD / (DENSITY * (own**2 - forced**2)) * shape
        errors.append(float(np.abs(w[middle] - exact).max()))
    print(f"largest deflection {np.abs(exact).max():.4f} m")
    observed = print_table("largest error [m], expected order 2", halvings, errors)
    # Next to (k h)^2 / 8 of the points, (O i)^2 / 8 of the slices stand their fourth powers.
    check("order", observed[-1], 2, within=0.1)
