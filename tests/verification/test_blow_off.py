"""Wires blown sideways: closed forms, a railway's examples, damping, a string of full geometry."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from measuring import check, matrix_of
from scipy.integrate import solve_bvp
from small_lines import BARE, HANGING, bare_wires, en50318_line, mesh_of, problem_of

from catenary.meshgen.mesh import CONTACT_WIRE, MESSENGER_WIRE
from catenary.meshgen.topologies.line_data import LineData
from catenary.meshgen.wires import Conductor
from catenary.solver.model.loads import FieldLoad
from catenary.solver.problem.wind import Gusts, Stretch, Wind
from catenary.solver.statics.form_finding import find_form

BLOWN = frozenset({"lateral_motion", "wind"})
# Span [m], speed [m/s], loads of contact and messenger wire [N/m], stagger [m], tensions [N], and
# the largest deflection of the contact wire alone and of both as one [m]: loads from Kiessling et
# al., Contact Lines for Electric Railways.
RE200 = (80.0, 26.0, (6.5, 5.0), 0.4, (10e3, 10e3), 0.597, 0.547)
RE330 = (65.0, 37.0, (13.7, 13.7), 0.3, (27e3, 21e3), 0.352, 0.376)


def wind(speed: float) -> Wind:
    return Wind(speed, height=10.0, density=1.25)


def wires(example: tuple) -> tuple[Conductor, Conductor]:
    """Without bending stiffness, with the diameters that have the loads of an example."""
    _, speed, loads, _, tensions, *_ = example
    widths = [p / (0.5 * 1.25 * speed**2) for p in loads]
    return tuple(
        Conductor(tension, 1.1, 0.0, diameter=width / 1.2)
        for tension, width in zip(tensions, widths, strict=True)
    )


def largest(line: LineData, wind: Wind, wire: str, n: int, names: frozenset[str]) -> float:
    """Largest deflection of a wire to the left in the span that it is staggered over [m]."""
    mesh = mesh_of(line, n)
    _, form = find_form(problem_of(line, names, wind=wind), mesh)
    assert form.lateral is not None
    nodes = mesh.wires[wire]
    inside = mesh.x(nodes) <= line.span_lengths[0]
    return float(form.lateral.y[nodes][inside].max())


@pytest.mark.parametrize("example", [RE200, RE330], ids=["Re200", "Re330"])
def test_a_contact_wire_alone_is_blown_off_as_by_the_parabola(example: tuple) -> None:
    """p L^2 / 8 T + (b1 + b2) / 2 + T (b2 - b1)^2 / 2 p L^2, tabulated to a millimetre."""
    span, speed, loads, stagger, tensions, alone, _ = example
    line = replace(bare_wires(span, *wires(example)), stagger=(stagger, -stagger))
    found = largest(line, wind(speed), CONTACT_WIRE, 64, BARE | BLOWN)
    p, tension = loads[0], tensions[0]
    exact = p * span**2 / (8 * tension) + tension * (2 * stagger) ** 2 / (2 * p * span**2)
    # The largest node is off the summit by less than half an element.
    near = p * (span / 128) ** 2 / (2 * tension)
    check("deflection [m]", found, exact, within=near + 1e-9)
    check("as tabulated [m]", found, alone, within=1e-3)


@pytest.mark.parametrize("example", [RE200, RE330], ids=["Re200", "Re330"])
def test_droppers_bring_the_two_wires_together(example: tuple) -> None:
    """With droppers the contact wire lies between where it is alone and where both are one wire."""
    span, speed, _, stagger, _, alone, both = example
    line = replace(
        en50318_line(1),
        span_lengths=(span,),
        dropper_positions=(tuple(span * (k + 0.5) / 8 for k in range(8)),),
        pre_sag=((0.0,) * 8,),
        stagger=(stagger, -stagger),
        messenger_stagger=(stagger, -stagger),
        encumbrance=1.8,
        contact_wire=wires(example)[0],
        messenger_wire=wires(example)[1],
    )
    found = largest(line, wind(speed), CONTACT_WIRE, 8, HANGING | BLOWN)
    low, high = sorted((alone, both))
    print(f"alone {alone} m, with droppers {found:.3f} m, as one {both} m")
    assert low - 1e-3 < found < high + 1e-3


def test_a_sheltered_stretch_stays_where_it_is() -> None:
    line = replace(bare_wires(60.0, *wires(RE200)), stagger=(0.0, 0.0))
    still = replace(wind(26.0), stretches=(Stretch(-1.0, 61.0, 0.0),))
    assert largest(line, still, MESSENGER_WIRE, 8, BARE | BLOWN) == 0.0
    assert largest(line, wind(26.0), MESSENGER_WIRE, 8, BARE | BLOWN) > 0.1
    blown = replace(wind(26.0), direction=-0.5 * np.pi)
    assert largest(line, blown, MESSENGER_WIRE, 8, BARE | BLOWN) == 0.0


def test_lateral_motion_is_damped_and_loaded_by_the_whole_drag() -> None:
    """C = rho U d C_d / m M sideways, half of it upward; gusts along the wind load so as well."""
    line = bare_wires(60.0, *wires(RE200))
    gusty = wind(26.0).with_gusts(Gusts(2.0, highest=1.0))
    names = BARE | BLOWN | {"gusts"}
    mesh = mesh_of(line, 8)
    model, _ = find_form(problem_of(line, names, wind=gusty, damping=NONE), mesh)
    mass, damping = (matrix_of(model, **{which: 1.0}) for which in ("mass", "damping"))
    rate = 2.0 * 6.5 / 26.0 / 1.1
    for name, share in (("v", 1.0), ("w", 0.5)):
        own = model.dofs(mesh.wires[CONTACT_WIRE], name)[1:-1]
        found = damping[own][:, own].toarray()
        check(f"C of {name}", found, share * rate * mass[own][:, own].toarray(), within=1e-12)
    vertical, lateral = (load for load in model.loads if isinstance(load, FieldLoad))
    assert not np.intersect1d(vertical.unknowns, lateral.unknowns).size
    assert vertical.interval == lateral.interval


NONE = problem_of(bare_wires(60.0)).damping.__class__(0.0, 0.0)


def full_geometry(speed: float, span: float, tension: float, width: float) -> float:
    """Deflection at mid-span of a string with a constant tension along it, between masts [m].

    Wind across the track on a string that stands at an angle to it: per length of arc the load is
    1/2 rho d C_d (U cos a)^2 along its normal. Solved as a boundary-value problem.
    """
    p = 0.5 * 1.25 * width * speed**2

    def right(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        square = 1.0 + y[1] ** 2
        return np.stack([y[1], -p / tension * np.sqrt(square)])

    x = np.linspace(0.0, span, 101)
    guess = np.stack([p * x * (span - x) / (2 * tension), p * (span - 2 * x) / (2 * tension)])
    found = solve_bvp(right, lambda a, b: np.array([a[0], b[0]]), x, guess, tol=1e-10)
    assert found.success
    return float(found.sol(0.5 * span)[0])


@pytest.mark.parametrize("speed", [20.0, 40.0, 60.0])
def test_small_slopes_hold_in_a_storm(speed: float) -> None:
    """What linear geometry leaves out is of the order of the slope squared, s = p L / 2 T.

    Normal load and curvature of full geometry, T y'' (1 + y'^2)^(-3/2) = -p (1 + y'^2)^(-1), give
    y'' = -p / T (1 + y'^2)^(1/2): 1 + s^2 / 12 times the parabola's height, at 60 m/s 0.2 %.
    """
    span, tension, width = 65.0, 15e3, 0.0144 * 1.2
    wire = Conductor(tension, 1.1, 0.0, diameter=0.0144)
    line = replace(bare_wires(span, wire, wire), stagger=(0.0, 0.0))
    found = largest(line, wind(speed), CONTACT_WIRE, 64, BARE | BLOWN)
    slope = 0.5 * 1.25 * width * speed**2 * span / (2 * tension)
    exact = full_geometry(speed, span, tension, width)
    print(f"slope at the masts {slope:.4f}, left out {1e2 * (exact / found - 1):.3f} %")
    check("deflection [m]", found, exact, within=slope**2 / 8 * exact + 1e-6)
