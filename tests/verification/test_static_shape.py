"""The line at rest: sag of single wires and of whole spans, dropper forces and lengths."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from measuring import check
from small_lines import (
    EN_CONTACT_WIRE,
    HANGING,
    ac_simple_line,
    bare_wires,
    en50318_line,
    mesh_of,
    problem_of,
)

from catenary import InputError
from catenary.meshgen.line import Fittings
from catenary.meshgen.mesh import CONTACT_WIRE, MESSENGER_WIRE
from catenary.meshgen.topologies.all_topologies import make_line
from catenary.meshgen.topologies.line_data import LineData
from catenary.solver.statics.elasticity import middle_span
from catenary.solver.statics.form_finding import find_form, lengths_to_cut

GRAVITY = 9.81
EPS = np.finfo(float).eps
WEIGHTS = frozenset({"vertical", "gravity"})


def flexible(line: LineData) -> LineData:
    """The same line with wires that do not resist bending."""
    return replace(
        line,
        contact_wire=replace(line.contact_wire, bending_stiffness=0.0),
        messenger_wire=replace(line.messenger_wire, bending_stiffness=0.0),
    )


def middle_droppers(line: LineData) -> slice:
    """The droppers of the middle span; all spans have equally many."""
    span = round(middle_span(make_line(line))[0] / line.span_lengths[0])
    count = len(line.dropper_positions[0])
    return slice(span * count, (span + 1) * count)


@pytest.mark.parametrize("wire", [CONTACT_WIRE, MESSENGER_WIRE])
def test_a_flexible_wire_sags_in_a_parabola(wire: str) -> None:
    """q s (l - s) / (2 T): a cubic element represents it, so that only round-off remains."""
    length, n_elements = 50.0, 20
    line = flexible(bare_wires(length))
    model, form = find_form(problem_of(line, WEIGHTS), mesh_of(line, n_elements))
    nodes = model.mesh.wires[wire]
    data = getattr(line, wire)
    s = model.mesh.x(nodes)
    top = line.contact_height + (line.encumbrance if wire == MESSENGER_WIRE else 0.0)
    sag = data.mass_per_length * GRAVITY * s * (length - s) / (2 * data.tension)
    # The condition number of a chain of n elements is of the order of n^2.
    round_off = EPS * n_elements**2 * top
    check(f"{wire}: height [m]", form.height[nodes], top - sag, within=round_off)
    slope = -data.mass_per_length * GRAVITY * (length - 2 * s) / (2 * data.tension)
    element = length / n_elements
    check(f"{wire}: slope [-]", form.slope[nodes], slope, within=round_off / element)


def test_a_stiff_wire_sags_like_a_tensioned_beam() -> None:
    """s (l - s) q / (2 T) less q EI / T^2 (1 - cosh(lambda (s - l/2)) / cosh(lambda l / 2))."""
    length, n_elements = 20.0, 80
    wire = replace(EN_CONTACT_WIRE, bending_stiffness=EN_CONTACT_WIRE.tension)
    line = bare_wires(length, contact_wire=wire)
    model, form = find_form(problem_of(line, WEIGHTS), mesh_of(line, n_elements))
    nodes = model.mesh.wires[CONTACT_WIRE]
    s, q, tension = model.contact_x, wire.mass_per_length * GRAVITY, wire.tension
    inverse = np.sqrt(tension / wire.bending_stiffness)
    layer = 1 - np.cosh(inverse * (s - length / 2)) / np.cosh(inverse * length / 2)
    sag = q * s * (length - s) / (2 * tension) - q / (tension * inverse**2) * layer
    # Interpolation error of the elements, |w''''| <= q lambda^2 / T at the ends, and round-off
    # times the condition number, bending of an element EI / h^4 against tension of all T / l^2.
    h = length / n_elements
    element = q * inverse**2 / tension * h**4 / 384
    round_off = EPS * line.contact_height * length**2 / (inverse**2 * h**4)
    height = form.height[nodes]
    check("height [m]", height, line.contact_height - sag, within=element + round_off)
    print(f"bending lifts the wire by {q / tension / inverse**2:.2e} m at most")
    assert element + round_off < 1e-4 * q / tension / inverse**2


def test_equally_spaced_droppers_carry_equal_weights_and_the_wire_sags_between_them() -> None:
    """A gap l between droppers at one height: T is reached with level ends, so that

    sag = q s (l - s) / (2 T) - q l / (2 T lambda) (coth(lambda l / 2)
          - cosh(lambda (s - l / 2)) / sinh(lambda l / 2)),   dropper force = q l.
    """
    gap, rounding = 6.0, 0.5  # [m]; 1 / lambda is five times that of the real wire
    tension = EN_CONTACT_WIRE.tension
    wire = replace(EN_CONTACT_WIRE, bending_stiffness=tension * rounding**2)
    places = tuple(gap / 2 + gap * k for k in range(10))
    line = replace(
        en50318_line(3),
        contact_wire=wire,
        dropper_positions=(places,) * 3,
        pre_sag=((0.0,) * 10,) * 3,
    )
    model, form = find_form(problem_of(line, WEIGHTS), mesh_of(line, 24))
    left = 60.0 + places[4]
    nodes = model.mesh.wires[CONTACT_WIRE]
    inside = (model.contact_x > left - 1e-9) & (model.contact_x < left + gap + 1e-9)
    s, half = model.contact_x[inside] - left, gap / 2
    q = wire.mass_per_length * GRAVITY
    layer = 1 / np.tanh(half / rounding) - np.cosh((s - half) / rounding) / np.sinh(half / rounding)
    sag = q * s * (gap - s) / (2 * tension) - q * gap * rounding / (2 * tension) * layer
    # Interpolation error of the boundary layer, and what the uneven gaps at the ends pass on by
    # exp(-l lambda) per gap, 14 gaps away.
    h = gap / 24
    element = q * gap / (2 * tension * rounding**3) * h**4 / 384
    uneven = q * gap * rounding / tension * np.exp(-14 * gap / rounding)
    height = form.height[nodes][inside]
    check("contact wire [m]", height, line.contact_height - sag, within=element + uneven)
    # Forces of a gap's two ends are exact by equilibrium and symmetry. Round-off: the six entries
    # of a row, up to 12 EI / h^3, are rounded when assembled, solved and multiplied.
    round_off = 18 * EPS * line.contact_height * 12 * wire.bending_stiffness / h**3
    middle = form.dropper_force[middle_droppers(line)][4:6]
    check("dropper forces [N]", middle, q * gap, within=round_off)


def test_messenger_wire_is_the_funicular_curve_of_its_loads() -> None:
    """In a middle span: w = -M / T with the bending moment M of a simple beam under the loads.

    Bending stiffness rounds every kink of this polygon: a load P adds P / (2 T lambda)
    exp(-lambda |x - x_P|), lambda = sqrt(T / EI). The supports stay where their springs hold them.
    """
    rounding = 0.5  # 1 / lambda [m], five times that of the real wire, so that elements resolve it
    line = en50318_line(9)
    tension = line.messenger_wire.tension
    wire = replace(line.messenger_wire, bending_stiffness=tension * rounding**2)
    line = replace(line, messenger_wire=wire)
    model, form = find_form(problem_of(line, WEIGHTS), mesh_of(line, 24))
    start, end = middle_span(model.problem.line)
    nodes = model.mesh.wires[MESSENGER_WIRE]
    x = model.mesh.x(nodes)
    inside = (x > start - 1e-9) & (x < end + 1e-9)
    s, span = x[inside] - start, end - start
    q = wire.mass_per_length * GRAVITY
    force = form.dropper_force[middle_droppers(line)]
    at = np.asarray(line.dropper_positions[0])
    weight = q * span + force.sum()
    moment = q * s * (span - s) / 2
    for place, load in zip(at, force, strict=True):
        moment += load * np.minimum(s * (span - place), place * (span - s)) / span

    def rounded(place: np.ndarray) -> np.ndarray:
        loads = np.concatenate([np.tile(force, 3), np.full(4, -weight)])
        places = np.concatenate([at - span, at, at + span, np.arange(-1, 3) * span])
        layers = np.exp(-np.abs(place[:, None] - places) / rounding)
        return layers @ loads * rounding / (2 * tension)

    support = line.contact_height + line.encumbrance - weight / line.support_stiffness
    expected = support - moment / tension + rounded(s) - rounded(np.zeros(1))
    # The anchors do not give way as the supports do; a support passes T / (k span) of that on to
    # the next, and the middle span is four supports away. Elements: interpolation of the largest
    # boundary layer, that of the support's reaction.
    uneven = tension / (line.support_stiffness * span)
    h = np.diff(x).max()
    element = weight * rounding / (2 * tension) * (h / rounding) ** 4 / 384
    within = weight / line.support_stiffness * uneven**4 + element
    check("messenger wire [m]", form.height[nodes][inside], expected, within=within)
    sag = (moment / tension).max()
    print(f"sag {sag:.4f} m, support gives way by {weight / line.support_stiffness:.4f} m")


def test_bending_stiffness_rounds_the_kinks_but_keeps_the_weights() -> None:
    """All that hangs in a middle span of the whole AC line is carried by its droppers."""
    line = ac_simple_line(7)
    model, form = find_form(problem_of(line, HANGING), mesh_of(line, 5))
    own = middle_droppers(line)
    kind, arm = line.dropper, line.steady_arm
    weight = GRAVITY * (
        line.contact_wire.mass_per_length * line.span_lengths[0]
        + 9 * kind.lower_clamp_mass
        + 0.5 * kind.mass_per_length * form.dropper_length[own].sum()
        + 0.5 * arm.mass_per_length * arm.length
        + arm.clamp_mass
    )
    # The spans at the ends differ, but bending passes that on by exp(-lambda d) per dropper, and
    # lambda d is 60. Length iteration: 1e-10 m of dropper. Round-off: K has entries up to
    # 12 EI / h^3, against heights of 5 m.
    h = np.diff(model.contact_x).min()
    stiffest = 12 * line.contact_wire.bending_stiffness / h**3
    within = EPS * stiffest * line.contact_height * 9 + GRAVITY * kind.mass_per_length * 1e-9
    check("sum of dropper forces [N]", form.dropper_force[own].sum(), weight, within=within)


def test_ac_simple_catenary_has_its_nominal_dropper_lengths() -> None:
    """Benchmark of ten codes, 2015."""
    line = ac_simple_line(7)
    _, form = find_form(problem_of(line, HANGING), mesh_of(line, 5))
    length = form.dropper_length[middle_droppers(line)]
    nominal = np.array([1.017, 0.896, 0.810, 0.758, 0.741, 0.758, 0.810, 0.896, 1.017])
    # The benchmark accepts 5 mm; its pre-sag is given in whole millimetres.
    check("dropper lengths [m]", length, nominal, within=0.005)


def test_droppers_are_cut_shorter_than_they_hang() -> None:
    """Unstretched length + force / stiffness is the distance of the wires at rest."""
    line = ac_simple_line(3)
    for stiff in (line.dropper, replace(line.dropper, stiffness=None, axial_stiffness=9e4)):
        problem = problem_of(replace(line, dropper=stiff), HANGING)
        model, form = find_form(problem, mesh_of(line, 3))
        distance = form.height[model.mesh.droppers[:, 0]] - form.height[model.mesh.droppers[:, 1]]
        stiffness = 1e5 if stiff.axial_stiffness is None else 9e4 / form.dropper_length
        stretched = form.dropper_length + form.dropper_force / stiffness
        # With EA the stiffness is that of the length as cut, in the last pass 1e-10 m away at most.
        check("distance of the wires [m]", stretched, distance, within=1e-10)
        print(f"stretched by {(distance - form.dropper_length).max() * 1e3:.2f} mm at most")


@pytest.mark.parametrize("more", ["", "lateral_motion", "fittings"])
def test_droppers_are_cut_to_the_same_lengths_on_every_mesh(more: str) -> None:
    """Meshes of one and five elements a gap, beside Hermite's elements that resolve the layer."""
    line = ac_simple_line(5)
    if more == "lateral_motion":
        line = replace(line, steady_arm=replace(line.steady_arm, inclination=np.deg2rad(10.0)))
    problem = problem_of(line, HANGING | {more} if more else HANGING)
    if more == "fittings":
        # Between droppers, and between nodes of the meshes.
        heavy = Fittings("section_insulator", CONTACT_WIRE, (123.4, 150.15), (15.0, 8.0))
        problem = replace(problem, line=replace(problem.line, fittings=(heavy,)))
    coarse, usual = (lengths_to_cut(problem, mesh_of(line, n)) for n in (1, 5))
    # What is left are the same nodes; where a mesh divides gaps they differ by round-off of x.
    check("lengths [m]", coarse, usual, within=1e-9)
    mesh = mesh_of(line, 64)
    _, form = find_form(problem, mesh)
    # A support's reaction P bends the wire within r = sqrt(EI / T); an element is off by
    # P r / (2 T) (h / r)^4 / 384 there, and a dropper hangs between two of them. Sideways the
    # stagger's kink does the same to a length that leans by 0.2: less than that.
    wire = line.messenger_wire
    layer = np.sqrt(wire.bending_stiffness / wire.tension)
    h = np.diff(mesh.x(mesh.wires[MESSENGER_WIRE])).max()
    reaction = 2 * form.dropper_force.max() + 55.0 * (1.08 + 1.35) * GRAVITY
    resolved = reaction * layer / (2 * wire.tension) * (h / layer) ** 4 / 384
    check("lengths [m]", usual, form.dropper_length, within=2 * resolved)
    _, unresolved = find_form(problem, mesh_of(line, 5))
    off = np.abs(unresolved.dropper_length - usual).max()
    print(f"five Hermite elements a gap are off by {1e3 * off:.2f} mm")
    assert off > 1e-3


def test_pre_sag_is_what_the_form_finding_delivers() -> None:
    """At the droppers the contact wire hangs below its height by the pre-sag."""
    line = ac_simple_line(5)
    model, form = find_form(problem_of(line, HANGING), mesh_of(line, 3))
    at = form.height[model.mesh.droppers[:, 1]]
    sag = np.concatenate([np.asarray(span) for span in line.pre_sag])
    # Heights of held nodes are prescribed: round-off of one subtraction.
    check("height at droppers [m]", at, line.contact_height - sag, within=4 * EPS * 5.08)


def test_a_dropper_that_would_be_slack_is_refused() -> None:
    line = en50318_line(3)
    # Held 0.3 m lower than its neighbours, the third dropper would have to push.
    sag = (0.0, 0.0, 0.3, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    bad = replace(line, pre_sag=(line.pre_sag[0], sag, line.pre_sag[0]))
    with pytest.raises(InputError, match=r"span 2 at 17\.00 m .* slack at rest"):
        find_form(problem_of(bad, HANGING), mesh_of(bad, 2))


def test_soft_droppers_settle_on_a_fine_mesh() -> None:
    """Round-off of 12 EI / h^3 times a height is some 1e-6 N, which stretches 1e3 N/m by 1e-9 m,
    in each pass another one, as what arms lift differs by round-off too."""
    line = ac_simple_line(3)
    soft = replace(line, dropper=replace(line.dropper, stiffness=1e3))
    soft = replace(soft, dropper_positions=((20.0, 20.8, 35.0),) * 3, pre_sag=((0.0,) * 3,) * 3)
    soft = replace(soft, steady_arm=replace(line.steady_arm, inclination=np.deg2rad(10.0)))
    problem = problem_of(soft, HANGING | {"lateral_motion"})
    _, form = find_form(problem, mesh_of(soft, 64))
    assert (form.dropper_length > 0.0).all()


def test_a_dropper_that_would_be_cut_to_nothing_is_refused() -> None:
    line = ac_simple_line(3)
    soft = replace(line, dropper=replace(line.dropper, stiffness=100.0))
    with pytest.raises(InputError, match=r"a length of -\d\.\d+ m before \d+ N stretch it"):
        find_form(problem_of(soft, HANGING), mesh_of(soft, 2))
