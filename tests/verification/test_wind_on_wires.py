"""Wind on wires: aerodynamic damping, loads of gusts, response of a span to its spectrum."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from measuring import check, free_dofs, march, matrix_of
from scipy import linalg
from scipy.integrate import trapezoid
from small_lines import BARE, EN_CONTACT_WIRE, bare_wires, mesh_of, numerics, problem_of, train

from catenary.meshgen.mesh import CONTACT_WIRE, MESSENGER_WIRE, LineMesh
from catenary.solver.model.loads import FieldLoad
from catenary.solver.model.model import Model
from catenary.solver.problem.problem import Damping, Problem
from catenary.solver.problem.wind import Gusts, Stretch, Wind, friction_velocity_of
from catenary.solver.statics.form_finding import find_form
from catenary.solver.wind import UPWARD, GustField, gust_points, narrowed

SPAN, RHO = 60.0, 1.225
DIAMETER, DRAG = 0.0144, 1.2
WIND = Wind(
    25.0,
    height=10.0,
    gusts=Gusts(friction_velocity_of(0.2, 25.0), highest=4.0, growth=0.0),
)
BOTH = BARE | {"wind", "gusts"}


def line():
    wires = (replace(EN_CONTACT_WIRE, diameter=DIAMETER, drag_coefficient=DRAG),) * 2
    return bare_wires(SPAN, *wires)


def problem(wind: Wind = WIND, names: frozenset[str] = BOTH, **changes: object) -> Problem:
    return problem_of(line(), names, wind=wind, damping=Damping(0.0, 0.0), **changes)


@pytest.fixture(scope="module")
def mesh() -> LineMesh:
    return mesh_of(line(), 24)


def model_of(mesh: LineMesh, *arguments: object) -> Model:
    model, _ = find_form(problem(*arguments), mesh)
    return model


@pytest.mark.parametrize("direction", [0.5 * np.pi, -0.5 * np.pi, np.pi / 6])
def test_wind_damps_vertical_motion_with_half_of_its_drag(mesh: LineMesh, direction: float) -> None:
    """C = 1/2 rho U d C_d / m M of a wire with mass m, U being the part across the track."""
    model = model_of(mesh, replace(WIND, direction=direction), BARE | {"wind"})
    across = 25.0 * abs(np.sin(direction))
    rate = 0.5 * RHO * across * DIAMETER * DRAG / EN_CONTACT_WIRE.mass_per_length
    mass, damping = (matrix_of(model, **{which: 1.0}) for which in ("mass", "damping"))
    own = model.dofs(mesh.wires[CONTACT_WIRE])[1:-1]
    found = damping[own][:, own].toarray()
    check("C", found, rate * mass[own][:, own].toarray(), within=1e-12)
    assert (damping != damping.T).nnz == 0 and rate > 0.05


def test_wind_along_the_track_leaves_wires_alone(mesh: LineMesh) -> None:
    model = model_of(mesh, replace(WIND, direction=0.0))
    assert not matrix_of(model, damping=1.0).nnz or not matrix_of(model, damping=1.0).data.any()
    (load,) = (load for load in model.loads if isinstance(load, FieldLoad))
    slices = np.empty((3, load.weights.shape[1]))
    load.fill(5, slice(0, slices.shape[1]), slices)
    assert not slices.any()


def load_and_field(mesh: LineMesh, wind: Wind) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Forces on one wire over time (m,), gusts (m, n) at points (n,) that made them."""
    model = model_of(mesh, wind)
    (load,) = model.loads
    slices = np.empty((50, load.weights.shape[1]))
    load.fill(200, slice(0, slices.shape[1]), slices)
    forces = np.zeros((50, model.n_dofs))
    forces[:, load.unknowns] = (load.weights @ slices.T).T
    points = gust_points(wind.gusts.spacing, 0.0, SPAN)
    gusts = np.empty_like(slices)
    GustField(wind, UPWARD, points, points[1]).fill(200, slice(0, points.size), gusts)
    return forces[:, model.dofs(mesh.wires[CONTACT_WIRE])].sum(axis=1), gusts, points


def test_upward_gusts_lift_with_half_of_the_drag(mesh: LineMesh) -> None:
    wind = replace(WIND, stretches=(Stretch(-1.0, 1e3, 1.2),))
    force, gusts, points = load_and_field(mesh, wind)
    # Mean and gusts are 1.2 times as strong there.
    per_length = 0.5 * RHO * DIAMETER * DRAG * 1.2 * 25.0 * 1.2 * gusts
    check("force [N]", force, trapezoid(per_length, points, axis=1), within=1e-9)
    assert force.std() > 1.0


@pytest.mark.parametrize("quadratic", [False, True])
def test_gusts_high_above_ground_are_as_strong_in_a_faster_mean(
    mesh: LineMesh, quadratic: bool
) -> None:
    """The friction velocity does not grow with the height, and Davenport's spectrum is that of all
    heights: a viaduct has the gusts of the plain, and their force grows with its mean wind alone.
    """
    wind = replace(WIND, quadratic=quadratic, stretches=(Stretch(-1.0, 1e3, 1.0, 40.0),))
    # Small ones, of which the square leaves one part in 1e5.
    wind = replace(wind, gusts=replace(wind.gusts, friction_velocity=1e-4))
    force, gusts, points = load_and_field(mesh, wind)
    there = 25.0 * np.log(40.0 / 0.05) / np.log(10.0 / 0.05)
    per_length = 0.5 * RHO * DIAMETER * DRAG * there * gusts
    expected = trapezoid(per_length, points, axis=1)
    check("force [N]", force, expected, within=2e-5 * np.abs(expected).max())


def test_the_square_of_the_wind_agrees_with_its_linear_part_for_small_gusts(mesh: LineMesh) -> None:
    """What is left out, 1/2 rho d C_d w u / U and smaller, falls with the square of the gusts."""
    errors = []
    for part in (1e-2, 1e-3):
        gusts = replace(WIND.gusts, friction_velocity=part)
        linear, _, _ = load_and_field(mesh, replace(WIND, gusts=gusts))
        square, _, _ = load_and_field(mesh, replace(WIND, gusts=gusts, quadratic=True))
        errors.append(np.abs(square - linear).max() / np.abs(linear).max())
    print(f"relative differences {errors}")
    check("order", np.log10(errors[0] / errors[1]), 1.0, within=0.1)


def modes(model: Model, wire: str, n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Circular frequencies (n,), shapes (k, n) with unit mass, and the free unknowns (k,)."""
    free = np.intersect1d(free_dofs(model), model.numbering.numbers[model.mesh.wires[wire]])
    mass, stiffness = (
        matrix_of(model, **{which: 1.0})[free][:, free].toarray() for which in ("mass", "stiffness")
    )
    values, shapes = linalg.eigh(stiffness, mass, subset_by_index=(0, n - 1))
    return np.sqrt(values), shapes, free


def test_a_span_answers_to_gusts_as_its_modes_do(mesh: LineMesh) -> None:
    """Buffeting theory (A. G. Davenport 1962): modal loads from spectrum and coherence, no field.

    S_jk(n) = (1/2 rho U d C_d)^2 S_w(n) int int phi_j(x) exp(-C n |x - y| / U) phi_k(y) dx dy.
    The field is linear between points 5 m apart: its load on the first modes, half waves of 60 to
    15 m, is 3 % off at most, and so is the standard deviation at mid-span.
    """
    model = model_of(mesh)
    (load,) = model.loads
    omega, shapes, free = modes(model, CONTACT_WIRE, 4)
    rate = 0.5 * RHO * 25.0 * DIAMETER * DRAG / EN_CONTACT_WIRE.mass_per_length
    field = GustField(WIND, UPWARD, gust_points(5.0, 0.0, SPAN))
    x = np.linspace(0.0, SPAN, 241)
    nodes = model.dofs(mesh.wires[CONTACT_WIRE])
    whole = np.zeros((model.n_dofs, 4))
    whole[free] = shapes
    phi = np.stack([np.interp(x, mesh.x(mesh.wires[CONTACT_WIRE]), w) for w in whole[nodes].T])
    middle = phi[:, x.size // 2]
    weights = np.zeros((model.n_dofs, load.weights.shape[1]))
    weights[load.unknowns] = load.weights.toarray()
    by_point = whole.T @ weights * 0.5 * RHO * 25.0
    points = gust_points(5.0, 0.0, SPAN)
    variance = np.zeros(2)
    dx = x[1] - x[0]
    for n, deviation in zip(field.frequencies, field.deviations, strict=True):
        decay = 10.0 * n / 25.0
        through = 1.0 / (omega**2 - (2 * np.pi * n) ** 2 + 2j * np.pi * n * rate)
        answer = middle * through
        between = np.exp(-decay * np.abs(points[:, None] - points))
        own = by_point @ between @ by_point.T * narrowed(0.5 * decay * 5.0)
        exact = np.exp(-decay * np.abs(x[:, None] - x))
        mode = phi * dx * 0.5 * RHO * 25.0 * DIAMETER * DRAG
        wanted = mode @ exact @ mode.T
        for i, joint in enumerate((own, wanted)):
            variance[i] += deviation**2 * float((answer @ joint @ answer.conj()).real)
    made, theory = 1e3 * np.sqrt(variance)
    check("standard deviation at mid-span [mm]", made, theory, within=0.03 * theory)


def test_a_march_moves_as_the_waves_of_its_field_drive_it(mesh: LineMesh) -> None:
    """Gusts switched on at rest: modes of a wire driven by the same slices, by exact formulas.

    It is the messenger wire, which nothing joins to the contact wire and its head.
    """
    duration, dt = 2.0, 2e-3
    creep = train(1.0, 20.0, 20.0 + duration + 0.5 * dt, static_force=0.0)
    moved = problem(train=creep, numerics=numerics(dt))
    history = march(moved, mesh, lambda view: view.checkpoint()["displacement"].copy())
    model, _ = find_form(moved, mesh)
    omega, shapes, free = modes(model, MESSENGER_WIRE, 24)
    (load,) = model.loads
    n_slices = round(duration / load.interval) + 2
    slices = np.empty((n_slices, load.weights.shape[1]))
    load.fill(0, slice(0, slices.shape[1]), slices)
    forces = np.zeros((n_slices, model.n_dofs))
    forces[:, load.unknowns] = (load.weights @ slices.T).T
    times = dt * np.arange(len(history.watched))
    at_slices = load.interval * np.arange(n_slices)
    modal = np.stack([np.interp(times, at_slices, f) for f in (forces[:, free] @ shapes).T])
    rate = 0.5 * RHO * 25.0 * DIAMETER * DRAG / EN_CONTACT_WIRE.mass_per_length
    answer = np.zeros((times.size, 24))
    for k, w in enumerate(omega):
        system = np.array([[0.0, 1.0], [-(w**2), -rate]])
        # Exact for a force that is linear over a step.
        block = np.zeros((4, 4))
        block[:2, :2], block[1, 2], block[2, 3] = system * dt, dt, 1.0
        step, state = linalg.expm(block), np.zeros(2)
        for i in range(1, times.size):
            start = np.array([*state, modal[k, i - 1], modal[k, i] - modal[k, i - 1]])
            state = (step @ start)[:2]
            answer[i, k] = state[0]
    middle = mesh.wires[MESSENGER_WIRE][mesh.wires[MESSENGER_WIRE].size // 2]
    at = np.flatnonzero(free == model.dofs(np.array([middle]))[0])[0]
    expected = answer @ shapes[at]
    rows = [row.reshape(mesh.n_nodes, -1)[model.row_of_node[middle], 0] for row in history.watched]
    found = np.array(rows)
    # Average acceleration is late by (w dt)^2 / 12 of w t, for the first mode of 1 Hz 1e-4 after
    # 2 s; higher modes of a gust load are small.
    print(f"largest {1e3 * np.abs(expected).max():.2f} mm")
    check("mid-span [m]", found, expected, within=0.01 * np.abs(expected).max())
