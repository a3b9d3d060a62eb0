"""The line at rest in the lateral plane against closed forms: zig-zag, curve, cant, arms.

Elements have continuous slopes: they round the kink of a chord at an arm over a ninth of their
length (found by refinement), by which a span is shorter to either side.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from measuring import check
from scipy import optimize
from small_lines import HANGING, ac_simple_line, bare_wires, en50318_line, mesh_of, problem_of

from catenary import InputError
from catenary.meshgen.line import Curve, DropperKind, SteadyArm
from catenary.meshgen.mesh import CONTACT_WIRE, MESSENGER_WIRE
from catenary.meshgen.topologies.line_data import LineData
from catenary.meshgen.wires import Conductor
from catenary.solver.model.rest_shape import Equilibrium, LateralShape
from catenary.solver.statics.elasticity import elasticity
from catenary.solver.statics.form_finding import find_form

# Of an element, what it takes off a chord at a kink.
ROUNDED = 0.12
LATERAL = HANGING | {"lateral_motion"}


def strings(line: LineData) -> LineData:
    """The line of wires without bending stiffness, the messenger wire above the contact wire."""
    return replace(
        line,
        contact_wire=replace(line.contact_wire, bending_stiffness=0.0),
        messenger_wire=replace(line.messenger_wire, bending_stiffness=0.0),
        messenger_stagger=line.stagger,
    )


def arm_slope(shape: LateralShape) -> np.ndarray:
    """Rise of each arm from its wire to its hinge over its length in plan, (n_arms,) [-]."""
    sideways, upward, along = shape.arm_direction.T
    return np.asarray(upward / np.hypot(sideways, along))


def at_rest(line: LineData, n: int = 3) -> tuple[Equilibrium, LateralShape]:
    _, form = find_form(problem_of(line, LATERAL), mesh_of(line, n))
    assert form.lateral is not None
    return form, form.lateral


def test_a_zig_zag_pulls_at_arms_with_4_t_a_over_l() -> None:
    """Wires over each other, so that no dropper leans: each wire is a chord from mast to mast."""
    line, h = strings(ac_simple_line(4)), 4.5 / 6
    form, shape = at_rest(line, 6)
    mesh = mesh_of(line, 6)
    for wire in (CONTACT_WIRE, MESSENGER_WIRE):
        nodes = mesh.wires[wire]
        chord = np.interp(mesh.x(nodes), line.support_positions, line.stagger)
        check(f"{wire} [m]", shape.y[nodes], chord, within=ROUNDED * h * 0.4 / 55)
    radial = 4 * 22e3 * 0.2 / 55
    sides = np.sign(line.stagger[1:-1])
    more = 2.2 * ROUNDED * h / 55 * radial
    check("radial force [N]", sides * shape.arm_force[:, 0], radial, within=more)
    # Droppers are those of the vertical plane, as they hang upright.
    flat, _ = find_form(problem_of(line, HANGING), mesh)[1], None
    arm = line.steady_arm
    weight = 9.81 * (0.5 * arm.mass_per_length * arm.length + arm.clamp_mass)
    check("weight on an arm [N]", shape.arm_force[:, 1], weight, within=1e-9)
    check(
        "slope of the arms [-]",
        arm_slope(shape),
        weight / np.abs(shape.arm_force[:, 0]),
        within=1e-12,
    )
    # The arms carry their own weight: the contact wire hangs higher beside them, not at droppers.
    lower = mesh.droppers[:, 1]
    check("dropper heights [m]", form.height[lower], flat.height[lower], within=1e-12)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_curve_pulls_at_arms_with_t_l_over_r_and_bows_by_its_versine(side: float) -> None:
    radius, line = 3000.0, strings(replace(en50318_line(4), stagger=(0.1,) * 5))
    line = replace(line, curve=Curve(side / radius))
    _, shape = at_rest(line, 2)
    mesh = mesh_of(line, 2)
    h, radial = 5.0 / 2, 20e3 * 60 / radius
    more = 2.2 * ROUNDED * h / 60 * radial
    check("radial force [N]", -side * shape.arm_force[:, 0], radial, within=more)
    for wire in (CONTACT_WIRE, MESSENGER_WIRE):
        nodes = mesh.wires[wire]
        middle = np.isin(np.round(mesh.x(nodes), 6), [30.0, 90.0, 150.0, 210.0])
        assert np.count_nonzero(middle) == 4
        versine = 60.0**2 / (8 * radius)
        less = ROUNDED * h * 30 / radius
        check(f"{wire} [m]", shape.y[nodes[middle]] - 0.1, side * versine, within=less)


def test_cant_lets_a_wire_hang_towards_the_centre_by_its_weight() -> None:
    """m g tan(tilt) L^2 / 8 T to the side, as it sags by m g L^2 / 8 T."""
    tilt, bare = 0.1, bare_wires(60.0)
    line = replace(strings(bare), curve=Curve(-1e-9, tilt))
    _, shape = at_rest(line, 4)
    mesh = mesh_of(line, 4)
    for name, wire in (
        (CONTACT_WIRE, bare.contact_wire),
        (MESSENGER_WIRE, bare.messenger_wire),
    ):
        middle = mesh.wires[name][2]
        expected = 9.81 * np.tan(tilt) * wire.mass_per_length * 60**2 / (8 * wire.tension)
        check(f"{name} [m]", shape.y[middle], -expected, within=1e-6)


def test_a_curve_grows_in_its_transitions() -> None:
    curve = Curve(1e-3, 0.1, (100.0, 500.0), 100.0)
    x = np.array([50.0, 100.0, 150.0, 200.0, 400.0, 475.0, 500.0, 600.0])
    share = np.array([0.0, 0.0, 0.5, 1.0, 1.0, 0.25, 0.0, 0.0])
    assert np.allclose(curve.curvature_at(x), 1e-3 * share, atol=1e-18)
    assert np.allclose(curve.sideways_pull_at(x), np.tan(0.1 * share), atol=1e-16)


# The line of docs: T 22 kN, a 0.2 m, spans of 60 m, arms of 1.22 m.
@pytest.mark.parametrize("degrees", [5.0, 10.0, 15.0])
def test_an_inclined_arm_is_a_spring_of_its_radial_force(degrees: float) -> None:
    """P/(l cos^3 a) + k_lat tan^2 a, k_lat = 2 sqrt(k_f T) coth(L sqrt(k_f/T)): derived for one
    wire on pendulums of k_f = g m/l_d, all wires else held. Droppers a metre apart stand for k_f.

    The closed form takes neighbouring masts as held sideways, which arms here are but for their
    own give: 2 %.
    """
    span, tension, stagger, length, hung = 60.0, 22e3, 0.2, 1.22, 1.2
    slope = np.deg2rad(degrees)
    n, p = 6, 4 * tension * stagger / span
    line = ac_simple_line(n)
    places = tuple(np.arange(0.5, span, 1.0).tolist())
    line = replace(
        strings(line),
        span_lengths=(span,) * n,
        dropper_positions=(places,) * n,
        pre_sag=((0.0,) * len(places),) * n,
        dropper=DropperKind(1e5, None, 0.0, 0.0, 0.0),
        # Far stiffer than it needs to be, so that it stays where it is and droppers are alike.
        messenger_wire=Conductor(1e9, 1e-3, 0.0),
        encumbrance=hung,
        # The clamp is as heavy as what the arm lifts, so that droppers stay taut.
        steady_arm=SteadyArm(length, 0.0, p * np.tan(slope) / 9.81, 0.0, inclination=slope),
    )
    mesh = mesh_of(line, 1)
    model, form = find_form(problem_of(line, LATERAL), mesh)
    assert form.lateral is not None
    check("radial force [N]", np.abs(form.lateral.arm_force[:, 0]), p, within=0.01 * p)
    flat, _ = find_form(problem_of(line, HANGING), mesh)
    mast = 3 * span
    with_arm, without = (1 / elasticity(m, mast - 1e-6, mast + 1e-6).lift[0] for m in (model, flat))
    k_f = 9.81 * 1.35 / hung
    k_lat = 2 * np.sqrt(k_f * tension) / np.tanh(span * np.sqrt(k_f / tension))
    expected = p / (length * np.cos(slope) ** 3) + k_lat * np.tan(slope) ** 2
    check("stiffness [N/m]", with_arm - without, expected, within=0.02 * expected)
    # The figures of the nonlinear minimum of energy: 252, 288 (290), 350 (347) N/m.
    figures = {5.0: 252.0, 10.0: 289.0, 15.0: 348.5}
    check("minimum of energy [N/m]", expected, figures[degrees], within=3.0)


def test_a_steep_arm_lifts_as_its_exact_geometry_says() -> None:
    """An arm of 20 degrees on a wire that springs hold: the nonlinear balance, solved by root
    finding, has the tangent of the linear bar, and leaves it by so much at 50 mm."""
    length, p, k = 1.22, 300.0, 700.0
    a = np.deg2rad(20.0)
    hinge = np.array([length * np.cos(a), length * np.sin(a)])

    def force_to_lift(w: float) -> float:
        """The wire rises by w; sideways it is pulled with p + k v away from the hinge."""
        v = hinge[0] - np.sqrt(length**2 - (hinge[1] - w) ** 2)
        along = hinge - np.array([v, w])
        tension = (p + k * v) / along[0] * length
        return p * np.tan(a) - tension * along[1] / length

    def bar(w: float) -> float:
        tension = p / np.cos(a)
        e = np.array([np.cos(a), np.sin(a)])
        across = np.array([-e[1], e[0]])
        matrix = 1e7 * np.outer(e, e) + tension / length * np.outer(across, across)
        matrix[0, 0] += k
        return float(w * (matrix[1, 1] - matrix[0, 1] ** 2 / matrix[0, 0]))

    step = 1e-5
    tangent = (force_to_lift(step) - force_to_lift(-step)) / (2 * step)
    check("tangent [N/m]", bar(1.0), tangent, within=1e-3 * tangent)
    lift = optimize.brentq(lambda w: force_to_lift(w) - bar(0.05), 0.0, 0.2)
    print(f"under the force that lifts the bar by 50 mm the arm rises by {1e3 * lift:.1f} mm")
    check("lift [m]", lift, 0.05, within=0.12 * 0.05)


def test_leaning_droppers_carry_the_same_weight_at_a_greater_tension() -> None:
    line = ac_simple_line(3)
    mesh = mesh_of(line, 3)
    form, shape = at_rest(line)
    flat = find_form(problem_of(line, HANGING), mesh)[1]
    _, sideways, up = form.dropper_vectors(mesh.droppers).T
    length = np.hypot(sideways, up)
    assert np.abs(sideways).max() > 0.1
    lift = form.dropper_force * up / length
    # The longer droppers weigh more, and arms carry their own weight: some newtons in all.
    assert np.abs(lift - flat.dropper_force).max() < 4.0
    assert (form.dropper_force >= lift).all()
    check("cut", form.dropper_length, length - form.dropper_force / 1e5, within=1e-14)
    # The contact wire in balance: arms, droppers, and its own pull at the anchors.
    lower = np.isin(mesh.droppers[:, 1], mesh.wires[CONTACT_WIRE])
    pull = (form.dropper_force * sideways / length)[lower].sum()
    nodes, tension = mesh.wires[CONTACT_WIRE], line.contact_wire.tension
    h = mesh.x(nodes)[1] - mesh.x(nodes)[0]
    ends = tension * (np.diff(shape.y[nodes])[[-1, 0]] / h) @ [1.0, -1.0]
    total = pull + shape.arm_force[:, 0].sum() + ends
    check("sum of lateral forces [N]", total, 0.0, within=0.01 * np.abs(shape.arm_force).max())


def test_arms_that_hold_a_height_stand_as_their_load_says_and_not_upright() -> None:
    line = ac_simple_line(3)
    line = replace(line, steady_arm=replace(line.steady_arm, holds_height=True))
    form, shape = at_rest(line)
    check(
        "slope [-]",
        arm_slope(shape) * np.abs(shape.arm_force[:, 0]),
        form.arm_lift,
        within=1e-9,
    )
    straight = replace(line, stagger=(0.0,) * 4)
    with pytest.raises(InputError, match=r"steady arm at 55\.00 m is .*holds_height"):
        at_rest(straight)
