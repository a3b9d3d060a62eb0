"""HHT and the generalized-alpha method against their definition and their theory.

The line steps them in a form of its own (`solver/integrators/line_integrator.py`), in which no
force of an earlier step appears. What is compared here is the form of the textbooks,

    M a(1 - a_m) + C v(1 - a_f) + K d(1 - a_f) = f(1 - a_f),      x(s) = s x_new + (1 - s) x_old,

and what its authors say of it (J. Chung, G. M. Hulbert, J. Appl. Mech. 60 (1993) 371-375): order
two, stable for every step, and the given spectral radius at infinite frequency.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from measuring import (
    check,
    free_dofs,
    free_matrices,
    line_alone,
    matrix_of,
    orders,
    release,
    step,
)
from scipy import linalg
from scipy.sparse import linalg as sparse_linalg
from small_lines import BARE, HANGING, bare_wires, en50318_line, mesh_of, numerics, problem_of

from catenary.meshgen.wires import Conductor
from catenary.solver.effects.build_model import build
from catenary.solver.model.loads import ShapeLoad, table
from catenary.solver.model.matrices import stiffness_matrix
from catenary.solver.model.model import Model
from catenary.solver.problem.integrator_parameters import integration_of
from catenary.solver.problem.problem import Damping, Numerics
from catenary.solver.statics.form_finding import find_form

METHODS = [
    ("generalized_alpha", 1.0),
    ("generalized_alpha", 0.9),
    ("generalized_alpha", 0.8),
    ("generalized_alpha", 0.5),
    ("generalized_alpha", 0.0),
    ("hht", 1.0),
    ("hht", 0.8),
    ("hht", 0.5),
]
EPS = np.finfo(float).eps
LENGTH, N_ELEMENTS = 60.0, 30
STRING = Conductor(tension=20e3, mass_per_length=1.35, bending_stiffness=0.0)
DAMPINGS = {
    "undamped": Damping(0.0, 0.0),
    "proportional": Damping(2.75e-3, 0.0125),
    "per component": Damping(1e-4, 0.0125, {"droppers": (1e-3, 0.0), "contact_wire": (5e-3, 0.0)}),
}


def settings(method: tuple[str, float], dt: float) -> Numerics:
    return numerics(dt, integrator=method[0], spectral_radius=method[1])


def textbook(
    method: tuple[str, float],
    dt: float,
    matrices: tuple[np.ndarray, np.ndarray, np.ndarray],
    start: tuple[np.ndarray, np.ndarray],
    loads: np.ndarray,
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Displacements and velocities step by step, all as the definition has it.

    ``matrices`` M, C, K (n, n), ``start`` d and v (n,), ``loads`` (n_steps + 1, n).
    """
    beta, gamma, a_m, a_f = integration_of(*method)
    mass, damping, stiffness = matrices
    d, v = start
    a = linalg.solve(mass, loads[0] - damping @ v - stiffness @ d)
    operator = (1 - a_m) * mass
    operator = operator + (1 - a_f) * (gamma * dt * damping + beta * dt**2 * stiffness)
    factor = linalg.lu_factor(operator)
    for before, now in zip(loads[:-1], loads[1:], strict=True):
        ahead = d + dt * v + dt**2 * (0.5 - beta) * a
        faster = v + dt * (1 - gamma) * a
        right = (1 - a_f) * now + a_f * before - a_m * (mass @ a)
        right = right - damping @ ((1 - a_f) * faster + a_f * v)
        right = right - stiffness @ ((1 - a_f) * ahead + a_f * d)
        a = linalg.lu_solve(factor, right)
        d, v = ahead + beta * dt**2 * a, faster + gamma * dt * a
        yield d, v


@pytest.mark.parametrize("method", METHODS, ids=str)
@pytest.mark.parametrize("damping", DAMPINGS.values(), ids=DAMPINGS.keys())
def test_steps_are_those_of_the_definition(method: tuple[str, float], damping: Damping) -> None:
    """Two spans, let go from rest with a jump in load: every unknown in each of 200 steps."""
    effects = HANGING | {"structural_damping"}
    line = en50318_line(2)
    model, _ = find_form(problem_of(line, effects, damping=damping), mesh_of(line, 2))
    free, dt, n_steps = free_dofs(model), 1e-3, 200
    matrices = tuple(
        matrix_of(model, **{name: 1.0})[free][:, free].toarray()
        for name in ("mass", "damping", "stiffness")
    )
    pulled = np.array([model.dofs(model.mesh.droppers[4, 1])])
    force = np.where(np.arange(n_steps + 1) > 50, 0.0, 200.0 * np.cos(np.arange(n_steps + 1)))
    force[0] = 0.0
    course = table(dt * np.arange(n_steps + 1), force)
    model = replace(model, loads=[ShapeLoad(pulled, np.ones(1), course)])
    loads = np.zeros((n_steps + 1, model.n_dofs))
    loads[:, pulled[0]] = force
    shape = np.zeros(model.n_dofs)
    shape[free] = linalg.solve(matrices[2], loads[1, free])
    zero = np.zeros(free.size)
    worst = scale = np.zeros(2)
    with line_alone(model, settings(method, dt)) as stepper:
        # In two passes; a prediction may have no share of b at radius 0.
        assert stepper.passes is not None or method[1] == 0.0
        release(stepper, shape, np.zeros(model.n_dofs), model)
        expected = textbook(method, dt, matrices, (shape[free], zero), loads[:, free])
        for number, (d, v) in enumerate(expected, start=1):
            stepper.load_at(number * dt)
            stepper.free_step()
            apart = stepper.displacement[free] - d, stepper.velocity[free] - v
            worst = np.maximum(worst, [np.abs(part).max() for part in apart])
            scale = np.maximum(scale, [np.abs(part).max() for part in (d, v)])
    # A solve with A leaves eps times its condition number, below 1e5, and errors add up.
    within = n_steps * 1e5 * EPS * scale
    check("displacement and velocity", worst, 0.0, within=within)


@pytest.fixture(scope="module")
def string() -> tuple[Model, np.ndarray, np.ndarray]:
    """A pinned string; its omega in ascending order and its modes (n_dofs, n), of unit mass."""
    line = bare_wires(LENGTH, contact_wire=STRING, messenger_wire=STRING)
    model = build(problem_of(line, BARE), mesh_of(line, N_ELEMENTS), np.zeros(0))
    nodes = model.mesh.wires["contact_wire"]
    own = np.concatenate([model.dofs(nodes), model.dofs(nodes, "theta_y")])
    free = free_dofs(model)
    mine = np.isin(free, own)
    mass, stiffness = (matrix[mine][:, mine].toarray() for matrix in free_matrices(model))
    square, shapes = linalg.eigh(stiffness, mass)
    modes = np.zeros((model.n_dofs, square.size))
    modes[free[mine]] = shapes
    return model, np.sqrt(square), modes


def amplification(model: Model, mode: np.ndarray, method: tuple[str, float], dt: float):
    """What one step of the line makes of a mode's displacement, velocity and accelerations.

    Matrix (4, 4); all are measured in the units that make the numbers alike: 1, 1/dt, 1/dt^2.
    HHT that damps nothing is Newmark's method: it has one acceleration alone, the matrix is (3, 3).
    """
    weight = matrix_of(model, mass=1.0) @ mode
    with line_alone(model, settings(method, dt)) as stepper:
        names = list(stepper.state())
        n = 3 if method == ("hht", 1.0) else 4
        assert len(names) == n
        units = np.array([1.0, 1.0 / dt, 1.0 / dt**2, 1.0 / dt**2])[:n]
        result = np.zeros((n, n))
        for column in range(n):
            start = {name: np.zeros(mode.size) for name in names}
            start[names[column]] = units[column] * mode
            stepper.restore(start)
            step(stepper)
            result[:, column] = [weight @ values for values in stepper.state().values()] / units
    return result


def vibration(values: np.ndarray) -> tuple[float, float]:
    """Angle per step and damping ratio of the pair of eigenvalues that is the vibration."""
    pair = max(np.log(values[values.imag > 0]), key=lambda value: value.real)
    return float(pair.imag), float(-pair.real / abs(pair))


@pytest.mark.parametrize("method", METHODS, ids=str)
def test_period_and_damping_of_a_string_are_those_of_theory(
    string: tuple[Model, np.ndarray, np.ndarray], method: tuple[str, float]
) -> None:
    """First mode, omega = pi / L sqrt(F / rho): frequency omega (1 - E x^2), damping ratio D x^3.

    What is left of both after these terms must fall with the orders of the next ones, 4 and 5.
    """
    model, _, modes = string
    omega = np.pi / LENGTH * np.sqrt(STRING.tension / STRING.mass_per_length)
    own = integration_of(*method)
    steps = np.array([0.2, 0.1])
    found = [
        vibration(linalg.eigvals(amplification(model, modes[:, 0], method, x / omega)))
        for x in steps
    ]
    angle, ratio = np.array(found).T
    longer, damped = 1.0 - angle / steps, ratio
    # The elements' error is below 1e-10 in the first mode: (pi / 30)^6 / 60480 = 2e-11.
    check("frequency", longer, own.frequency_error * steps**2, within=2 * steps**4)
    print(f"damping ratio {damped}, leading term {own.third_order_damping * steps**3}")
    rest = np.abs(longer - own.frequency_error * steps**2)
    # The term after the next is x^2 smaller, with a coefficient that theory keeps of order one.
    check("order of what is left of the frequency", orders(list(rest)), 4, within=0.35)
    if method[1] == 1.0:
        check("damping ratio", damped, 0.0, within=1e-11)
        return
    assert (damped > 0).all()
    rest = np.abs(damped - own.third_order_damping * steps**3)
    check("order of what is left of the damping", orders(list(rest)), 5, within=0.5)


@pytest.mark.parametrize("method", METHODS, ids=str)
def test_no_step_is_unstable_and_the_fastest_vibrations_shrink_by_the_spectral_radius(
    string: tuple[Model, np.ndarray, np.ndarray], method: tuple[str, float]
) -> None:
    model, omega, modes = string
    for number in (0, -1):
        for x in np.logspace(-2, 4, 13):
            matrix = amplification(model, modes[:, number], method, x / omega[number])
            radius = np.abs(linalg.eigvals(matrix)).max()
            # Round-off of the entries is magnified by the multiplicity of the root, up to 3.
            assert radius < 1.0 + 1e-9 + (EPS * x**2) ** (1 / 3), (method, x, radius)
    # Roots that meet at infinity are apart by up to (1 / x^2)^(1/3) before, and by the same root
    # of the round-off, which grows with the condition of A like x^2.
    within = 3.0 * (x ** (-2 / 3) + (EPS * x**2) ** (1 / 3))
    check(f"{method}, omega dt = {x:g}: spectral radius", radius, method[1], within=within)


@pytest.mark.parametrize("radius", [0.7, 0.5, 0.0])
def test_the_energy_falls_by_what_the_method_takes_from_each_mode(radius: float) -> None:
    """Two spans with droppers, let go from their lift under a force: the audit of a run's energies.

    A mode's energy shrinks by the square of the modulus of its eigenvalue in each step.
    """
    line = en50318_line(2)
    model, _ = find_form(problem_of(line, HANGING), mesh_of(line, 3))
    method, dt, n_steps = ("generalized_alpha", radius), 1e-2, 2000
    load = np.zeros(model.n_dofs)
    load[model.dofs(model.mesh.droppers[4, 1])] = 200.0
    lifted = sparse_linalg.spsolve(stiffness_matrix(model), load)
    totals = []
    with line_alone(model, settings(method, dt)) as stepper:
        release(stepper, lifted, np.zeros_like(lifted), model)
        for number in range(n_steps + 1):
            if number % 10 == 0:
                totals.append(sum(stepper.energies()))
            step(stepper)
    mass, stiffness = (matrix.toarray() for matrix in free_matrices(model))
    square, shapes = linalg.eigh(stiffness, mass)
    energy = 0.5 * square * (shapes.T @ mass @ lifted[free_dofs(model)]) ** 2
    modulus = np.array([_modulus(method, np.sqrt(s) * dt) for s in square])
    left = energy * modulus ** (2 * np.arange(0, n_steps + 1, 10)[:, None])
    expected = left.sum(axis=1)
    print(f"left after {n_steps} steps: {totals[-1]:.4f} of {totals[0]:.4f} J")
    # Beside its decay the energy of a mode swings within its period: d and v are those of the
    # vibration but for a share (omega dt)^2, by which the orbit is no longer round.
    swing = left @ np.minimum(1.0, square * dt**2)
    check("energy [J]", totals, expected, within=swing)
    # What is lost is far more than that.
    assert totals[0] - totals[-1] > 2.0 * swing[-1]


def _modulus(method: tuple[str, float], x: float) -> float:
    """Largest modulus of the textbook's eigenvalues at omega dt = x."""
    beta, gamma, a_m, a_f = integration_of(*method)
    columns = []
    for d, v, a in np.eye(3):
        ahead, faster = d + v + (0.5 - beta) * a, v + (1 - gamma) * a
        new = -a_m * a - x**2 * ((1 - a_f) * ahead + a_f * d)
        new /= 1 - a_m + (1 - a_f) * beta * x**2
        columns.append([ahead + beta * new, faster + gamma * new, new])
    return float(np.abs(linalg.eigvals(np.array(columns).T)).max())
