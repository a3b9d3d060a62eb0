"""Order in the time step of every method that advances the line, in one table.

Newmark's method is of order 2 for gamma = 1/2 and of order 1 otherwise, whatever beta is: the
frequency of a mode is off by (omega dt)^2 (1/12 + (beta - 1/4) / 2), its decay by
(gamma - 1/2) omega dt / 2. HHT and the generalized-alpha method are of order 2 at every spectral
radius, their decay being of order 3.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from measuring import (
    check,
    free_dofs,
    free_matrices,
    line_alone,
    march,
    matrix_of,
    order_of_march,
    orders,
    print_table,
    release,
    step,
)
from scenes import load_scene
from scenes import mesh_of as mesh_of_scene
from scenes import problem_of as problem_of_scene
from scipy import linalg
from small_lines import (
    EN_PANTOGRAPH,
    HANGING,
    en50318_line,
    mesh_of,
    numerics,
    problem_of,
    train,
)

from catenary.meshgen.mesh import CONTACT_WIRE
from catenary.postproc.evaluate import filters
from catenary.solver.model.model import Model
from catenary.solver.problem.integrator_parameters import NEWMARK, integration_of
from catenary.solver.problem.problem import Damping
from catenary.solver.statics.form_finding import find_form

# Average acceleration, a softer relative, two of Newmark's that damp, and those that damp with
# order 2.
SCHEMES: list[tuple[dict[str, Any], int]] = [
    ({"gamma": 0.5, "beta": 0.25}, 2),
    ({"gamma": 0.5, "beta": 0.3025}, 2),
    ({"gamma": 0.6, "beta": 0.3025}, 1),
    ({"gamma": 0.55, "beta": 0.275625}, 1),
    ({"integrator": "generalized_alpha", "spectral_radius": 0.8}, 2),
    ({"integrator": "generalized_alpha", "spectral_radius": 0.0}, 2),
    ({"integrator": "hht", "spectral_radius": 0.7}, 2),
]
DAMPINGS = {
    "undamped": Damping(0.0, 0.0),
    "proportional": Damping(2.75e-3, 0.0125),
    "per component": Damping(1e-4, 0.0125, {"droppers": (1e-3, 0.0), "contact_wire": (5e-3, 0.0)}),
}
DURATION = 0.4
MODES = 6


def whole_line(damping: Damping) -> Model:
    """Two spans of the EN line with droppers, arms and supports, as a linear system."""
    line = en50318_line(2)
    effects = HANGING | {"structural_damping"}
    model, _ = find_form(problem_of(line, effects, damping=damping), mesh_of(line, 2))
    return model


def lowest_modes(model: Model) -> tuple[np.ndarray, float]:
    """An initial shape of the lowest modes (n_dofs,) and the highest omega in it [1/s]."""
    mass, stiffness = free_matrices(model)
    square, shapes = linalg.eigh(
        stiffness.toarray(), mass.toarray(), subset_by_index=[0, MODES - 1]
    )
    displacement = np.zeros(model.n_dofs)
    displacement[free_dofs(model)] = shapes.sum(axis=1)
    return displacement / np.abs(displacement).max(), float(np.sqrt(square[-1]))


def exact(model: Model, displacement: np.ndarray) -> np.ndarray:
    """The state after ``DURATION``, started from rest: exponential of the first-order system."""
    free = free_dofs(model)
    n = free.size
    mass, stiffness = (matrix.toarray() for matrix in free_matrices(model))
    damping = matrix_of(model, damping=1.0)[free][:, free].toarray()
    system = np.zeros((2 * n, 2 * n))
    system[:n, n:] = np.eye(n)
    system[n:, :n] = -linalg.solve(mass, stiffness)
    system[n:, n:] = -linalg.solve(mass, damping)
    start = np.concatenate([displacement[free], np.zeros(n)])
    result = np.zeros(model.n_dofs)
    result[free] = (linalg.expm(DURATION * system) @ start)[:n]
    return result


@pytest.mark.parametrize("damping", DAMPINGS.values(), ids=DAMPINGS.keys())
def test_schemes_converge_with_their_order_to_the_matrix_exponential(damping: Damping) -> None:
    model = whole_line(damping)
    assert model.damping_is_proportional == (not damping.per_component)
    shape, omega = lowest_modes(model)
    reference = exact(model, shape)
    sizes = [DURATION / n for n in (100, 200, 400, 800)]
    for changes, order in SCHEMES:
        errors = []
        for dt in sizes:
            with line_alone(model, numerics(dt, **changes)) as line:
                release(line, shape, np.zeros_like(shape), model)
                for _ in range(round(DURATION / dt)):
                    step(line)
                errors.append(float(np.abs(line.displacement - reference).max()))
        title = f"{changes}: expected order {order}"
        observed = print_table(title, [f"{1e3 * dt:g} ms" for dt in sizes], errors)
        # The next term, seen by the coarser step of the last pair: with gamma = 1/2 odd powers
        # vanish and it is smaller by (omega dt)^2, omega being the highest one in the motion;
        # methods that damp with order 3 have that beside the error of the frequency, and those of
        # order 1 the error of the frequency beside that of the decay.
        x = omega * sizes[-2]
        own = integration_of(
            changes.get("integrator", NEWMARK),
            changes.get("spectral_radius", 1.0),
            changes.get("beta", 0.25),
            changes.get("gamma", 0.5),
        )
        following = x * own.frequency_error / own.first_order_damping if order == 1 else x**2
        if order == 2:
            following += x * own.third_order_damping / own.frequency_error
        check(title, observed[-1], order, within=np.log2(1 + following))


@pytest.mark.parametrize(
    "changes",
    [{}, {"integrator": "generalized_alpha", "spectral_radius": 0.5}],
    ids=["average acceleration", "generalized alpha"],
)
def test_the_march_with_a_pantograph_is_of_order_2(changes: dict[str, Any]) -> None:
    """Contact force of a linear line under a moving pantograph, against a fine reference."""
    line, speed = en50318_line(3), 50.0
    mesh = mesh_of(line, 3)
    problem = problem_of(
        line,
        HANGING | {"structural_damping", "contact_damping"},
        train=train(speed, 70.0, 110.0, raise_time=0.2),
    )
    problem = replace(problem, contact=replace(problem.contact, damping=50.0))

    problem = replace(problem, numerics=numerics(1e-3, **changes))
    observed, expected = order_of_march(problem, mesh, 4)
    # The next terms: (omega dt)^2 of the fastest motion, the head against half an element of wire
    # on the contact spring; and the share V dt / h of the steps that pass from one element to the
    # next, where the second derivative of the contact's place in the equations jumps.
    h = float(np.diff(mesh.x(mesh.wires[CONTACT_WIRE])).min())
    masses = (EN_PANTOGRAPH.masses[0], line.contact_wire.mass_per_length * h / 2)
    omega = np.sqrt(problem.contact.stiffness * sum(1 / mass for mass in masses))
    coarser = 1e-3 / 4  # of the two steps of the last order
    following = (omega * coarser) ** 2 + speed * coarser / h
    check("order of the march", observed, expected, within=np.log2(1 + following))


@pytest.mark.study
@pytest.mark.parametrize(
    "overrides",
    [
        ("numerics.integrator=newmark",),
        pytest.param(
            ("numerics.integrator=generalized_alpha", "numerics.spectral_radius=0.8"),
            marks=pytest.mark.study,
        ),
        pytest.param(
            ("numerics.integrator=hht", "numerics.spectral_radius=0.8"), marks=pytest.mark.study
        ),
    ],
    ids=["average acceleration", "generalized alpha", "HHT"],
)
def test_the_reference_model_s_contact_force_is_of_order_2(overrides: tuple[str, ...]) -> None:
    """EN 50318 with droppers that slacken, below 20 Hz as it is judged, over two spans."""
    shortened = (
        "train.start_m=330", "train.end_m=470", "evaluation.from_m=390", "evaluation.to_m=460",
    )  # fmt: skip
    scene = load_scene("en50318_2002", [*overrides, *shortened])
    problem, mesh = problem_of_scene(scene), mesh_of_scene(scene)

    def force(dt: float) -> np.ndarray:
        """Contact force below 20 Hz every 2 ms, without the ends that the filter sees past."""
        own = replace(problem, numerics=replace(problem.numerics, dt=dt))
        found = march(own, mesh)["contact_force"][:, 0]
        return filters.low_pass(found, dt)[:: round(2e-3 / dt)][400:-50]

    steps = [1e-3, 0.5e-3, 0.25e-3]
    reference = force(0.0625e-3)
    errors = [float(np.sqrt(((force(dt) - reference) ** 2).mean())) for dt in steps]
    observed = print_table(
        "rms error of the contact force [N], expected order 2",
        [f"{1e3 * dt:g} ms" for dt in steps],
        errors,
    )
    # The reference's own error is 1/16 of the finest's. 20 Hz at the pantograph send waves of
    # 47 Hz ahead, whose next term is (2 pi 47 Hz dt)^2 = 2 % at 0.5 ms, and droppers slacken and
    # tighten somewhere within a step: over all, a tenth of an order at the finest pair, and two at
    # the other.
    check("order", observed[-1], orders([1 - 1 / 64, 1 / 4 - 1 / 64])[0], within=0.1)
    check("order", observed[0], orders([1 - 1 / 256, 1 / 4 - 1 / 256])[0], within=0.2)
