"""Order of Hermite elements in the element length h, on a beam where they are not exact at nodes.

A pinned beam with tension T under its weight q per length obeys EI w'''' - T w'' = -q and sags by

    s(x) = q x (L - x) / (2 T) - q EI / T^2 (1 - cosh(lambda (x - L/2)) / cosh(lambda L / 2)),

lambda = sqrt(T / EI). Cubic elements represent w with an error of h^4 |w''''| / 384 at most, and
the tension keeps the nodes from being exact; both are of order 4. Derivatives lose one order each.
"""

from __future__ import annotations

import numpy as np
from measuring import check, print_table
from small_lines import bare_wires, mesh_of, problem_of

from catenary.meshgen.mesh import CONTACT_WIRE
from catenary.meshgen.wires import Conductor
from catenary.solver.model.beam import shape_slopes, shape_values
from catenary.solver.statics.form_finding import find_form

# lambda = 1/m: the boundary layer fills a tenth of the span, and all meshes resolve it.
LENGTH, LAMBDA = 10.0, 1.0
WIRE = Conductor(tension=1000.0, mass_per_length=1.0, bending_stiffness=1000.0 / LAMBDA**2)
SIZES = [8, 16, 32, 64]
PLACES = np.linspace(0.0, 1.0, 17)


def exact(x: np.ndarray, gravity: float) -> tuple[np.ndarray, np.ndarray]:
    """Height [m] and slope [-] relative to the pinned ends."""
    q, tension = WIRE.mass_per_length * gravity, WIRE.tension
    middle = LAMBDA * (x - LENGTH / 2)
    end = np.cosh(LAMBDA * LENGTH / 2)
    sag = q * x * (LENGTH - x) / (2 * tension)
    sag -= q / (tension * LAMBDA**2) * (1 - np.cosh(middle) / end)
    slope = q * (LENGTH - 2 * x) / (2 * tension) + q / (tension * LAMBDA) * np.sinh(middle) / end
    return -sag, -slope


def errors(n_elements: int) -> tuple[float, float, float]:
    """Largest and root-mean-square error of the height [m] and largest one of the slope [-]."""
    line = bare_wires(LENGTH, contact_wire=WIRE)
    problem = problem_of(line, frozenset({"vertical", "gravity"}))
    model, form = find_form(problem, mesh_of(line, n_elements))
    dofs, length = model.wire_elements(CONTACT_WIRE)
    state = np.zeros(model.n_dofs)
    nodes = model.mesh.wires[CONTACT_WIRE]
    state[model.dofs(nodes)] = form.height[nodes] - line.contact_height
    state[model.dofs(nodes, "theta_y")] = form.slope[nodes]
    of_height, of_slope = [], []
    for place in PLACES:
        value = shape_values(float(place), float(length[0]))
        slope = shape_slopes(float(place), float(length[0]))
        x = model.contact_x[:-1] + place * length
        height_there, slope_there = exact(x, problem.gravity)
        of_height.append(state[dofs] @ value - height_there)
        of_slope.append(state[dofs] @ slope - slope_there)
    heights, slopes = np.array(of_height), np.array(of_slope)
    return (
        float(np.abs(heights).max()),
        float(np.sqrt((heights**2).mean())),
        float(np.abs(slopes).max()),
    )


def test_height_inside_elements_is_of_order_4_and_slope_of_order_3() -> None:
    largest, mean, slope = (
        list(column) for column in zip(*(errors(n) for n in SIZES), strict=True)
    )
    # w'''' falls off from the pinned ends as exp(-lambda x). The largest error of the height stands
    # in the middle of the first element and that of the slope at 0.211 of it, so that the errors
    # go with h^4 exp(-lambda h / 2) and h^3 exp(-0.211 lambda h); what follows is (lambda h)^2.
    coarse = LAMBDA * LENGTH / SIZES[-2]
    for name, theory, found, place in (
        ("height, largest error [m]", 4, largest, 0.5),
        ("height, rms error [m]", 4, mean, 0.0),
        ("slope, largest error [-]", 3, slope, 0.5 - np.sqrt(1 / 12)),
    ):
        observed = print_table(f"{name}, expected order {theory}", SIZES, found)
        expected = theory - place * (coarse - coarse / 2) / np.log(2)
        check(f"{name}: order", observed[-1], expected, within=coarse**2)


def test_largest_error_is_that_of_interpolation() -> None:
    """h^4 |w''''| / 384 in the middle of the first element; the nodes add (lambda h)^2 of it."""
    curvature = WIRE.mass_per_length * 9.81 / WIRE.tension * LAMBDA**2
    for n_elements in SIZES[1:]:
        h = LENGTH / n_elements
        expected = curvature * np.exp(-LAMBDA * h / 2) * h**4 / 384
        check(
            f"{n_elements} elements: largest error [m]",
            errors(n_elements)[0],
            expected,
            within=(LAMBDA * h) ** 2 * expected,
        )
