"""Twin and single lines and overlaps at rest: closed forms, equal lines, mirror images, balance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from measuring import check
from more_wires import data_of
from small_lines import ac_simple_line, bare_wires, problem_of

from catenary.meshgen.build import make_mesh
from catenary.meshgen.line import Line, SteadyArm
from catenary.meshgen.mesh import CONTACT_WIRE, MESSENGER_WIRE, LineMesh
from catenary.meshgen.topologies.all_topologies import BRIDLE_WIRE, make_line, second
from catenary.meshgen.topologies.line_data import ClampedWire, LineData, Overlaps, Twin
from catenary.meshgen.topologies.overlaps import of_next
from catenary.meshgen.wires import Conductor, Role
from catenary.solver.model import beam
from catenary.solver.model.rest_shape import Equilibrium
from catenary.solver.statics.elasticity import elasticity
from catenary.solver.statics.form_finding import find_form

GRAVITY = 9.81
TWIN = Twin(0.06, False)


def at_rest(line: LineData | Line, n: int = 3) -> tuple[LineMesh, Equilibrium]:
    line = make_line(line) if isinstance(line, LineData) else line
    mesh = make_mesh(line, n)
    return mesh, find_form(problem_of(line), mesh)[1]


def heights(mesh: LineMesh, form: Equilibrium, wire: str) -> np.ndarray:
    return form.height[mesh.wires[wire]]


def test_twin_wires_on_pairs_of_droppers_hang_like_one_twice_as_heavy() -> None:
    """Everything of the contact wire doubled, the same differential equations result."""
    data = ac_simple_line(5)
    mesh, form = at_rest(replace(data, topology="twin", twin=TWIN))
    assert data.dropper is not None
    one, kind, arm = data.contact_wire, data.dropper, data.steady_arm
    assert kind.stiffness is not None
    doubled = replace(
        data,
        contact_wire=Conductor(2 * one.tension, 2 * one.mass_per_length, 2 * one.bending_stiffness),
        dropper=replace(
            kind,
            stiffness=2 * kind.stiffness,
            mass_per_length=2 * kind.mass_per_length,
            upper_clamp_mass=2 * kind.upper_clamp_mass,
            lower_clamp_mass=2 * kind.lower_clamp_mass,
        ),
        steady_arm=replace(
            arm, mass_per_length=2 * arm.mass_per_length, clamp_mass=2 * arm.clamp_mass
        ),
    )
    single_mesh, single = at_rest(doubled)
    for wire, like in (
        (CONTACT_WIRE, CONTACT_WIRE),
        (second(CONTACT_WIRE), CONTACT_WIRE),
        (MESSENGER_WIRE, MESSENGER_WIRE),
    ):
        check(wire, heights(mesh, form, wire), heights(single_mesh, single, like), within=1e-9)
    for number in (0, 1):
        own = form.dropper_force[mesh.dropper_group == number]
        check("dropper forces [N]", 2 * own, single.dropper_force, within=1e-6)


def test_alternating_droppers_hang_one_wire_each() -> None:
    data = ac_simple_line(3)
    line = make_line(replace(data, topology="twin", twin=replace(TWIN, alternating=True)))
    one, other = (np.array(group.lower_x) for group in line.droppers)
    np.testing.assert_array_equal(np.sort(np.concatenate([one, other])), data.dropper_x)
    assert (one[:13] < other).all() and (other < one[1:]).all()
    sideways = [wire.pieces[0].y for wire in line.wires[:2]]
    np.testing.assert_allclose(np.subtract(*sideways), 0.06, atol=1e-15)


def test_two_simple_catenaries_side_by_side_hang_like_one() -> None:
    data = ac_simple_line(4)
    mesh, form = at_rest(replace(data, topology="twin_messenger", twin=TWIN))
    alone_mesh, alone = at_rest(data)
    for wire in (CONTACT_WIRE, MESSENGER_WIRE):
        for name in (wire, second(wire)):
            check(name, heights(mesh, form, name), heights(alone_mesh, alone, wire), within=1e-10)
    assert np.isin(mesh.supports, mesh.wires[MESSENGER_WIRE]).sum() == 3


def single(bridle: ClampedWire | None = None) -> LineData:
    """Spans of 30 m of a string of 0.95 kg/m at 10 kN, on supports that hardly give."""
    n = 8
    return replace(
        bare_wires(30.0),
        topology="single",
        span_lengths=(30.0,) * n,
        dropper_positions=((),) * n,
        pre_sag=((),) * n,
        stagger=(0.0,) * (n + 1),
        contact_wire=Conductor(10e3, 0.95, 0.0),
        messenger_wire=None,
        dropper=None,
        support_stiffness=1e12,
        steady_arm=SteadyArm(0.0, 0.0, 0.0, 0.0),
        bridle=bridle,
    )


def test_a_single_string_sags_and_gives_way_as_a_closed_form_says() -> None:
    """Sag m g x (L - x) / 2 T, elasticity x (L - x) / (T L); elements round off kinks at the masts
    within some elements, an error of first order beyond: extrapolated."""
    line = make_line(single())
    found = []
    for n in (30, 60):
        mesh = make_mesh(line, n)
        model, form = find_form(problem_of(line), mesh)
        x = np.arange(5.0, 25.5, 1.0)
        places = mesh.x(mesh.wires[CONTACT_WIRE])
        own = form.height[mesh.wires[CONTACT_WIRE]][np.searchsorted(places, 90.0 + x - 1e-6)]
        lift = elasticity(model, 90.0, 120.0)
        found.append((own, lift.lift[np.searchsorted(lift.x, 90.0 + x - 1e-6)]))
        at_masts = np.isin(places.round(6), line.support_positions)
        held = form.height[mesh.wires[CONTACT_WIRE]][at_masts]
        assert (held == line.wires[0].top).all()  # at the height wanted
    height, lift = (2.0 * fine - coarse for coarse, fine in zip(*found, strict=True))
    sag = 0.95 * GRAVITY * x * (30.0 - x) / (2 * 10e3)
    check("sag [m]", line.wires[0].top - height, sag, within=1e-5)
    check("elasticity [m/N]", lift, x * (30.0 - x) / (10e3 * 30.0), within=1e-6)


def test_a_bridle_hangs_as_statics_says() -> None:
    """The support's force, the weight of a span, hangs on two halves of the bridle; between its
    clamps the contact wire has what the bridle leaves of its tension."""
    bridle = ClampedWire(Conductor(2e3, 0.31, 0.0), 8.0, 0.4, 1e9)
    line = make_line(single(bridle))
    read = []
    for n in (8, 16):
        mesh, form = at_rest(line, n)
        mast = float(line.support_positions[4])
        nodes = mesh.wires[BRIDLE_WIRE]
        top = form.height[nodes[np.argmin(np.abs(mesh.x(nodes) - mast))]]
        contact = mesh.wires[CONTACT_WIRE]
        at = [form.height[contact[np.argmin(np.abs(mesh.x(contact) - x))]]
              for x in (mast, mast + 4.0)]  # fmt: skip
        read.append(np.array([*at, top]))
        np.testing.assert_allclose(
            form.height[contact[np.isin(mesh.x(contact).round(6), line.support_positions)]], 5.5
        )
    weight = GRAVITY * (0.95 * 30.0 + 0.31 * 8.0 + 2 * 0.4)
    clamp = 5.5 + GRAVITY * 0.95 * 4.0**2 / (2 * 8e3)
    rise = (weight / 2 * 4.0 - GRAVITY * 0.31 * 4.0**2 / 2) / 2e3
    check("heights [m]", 2 * read[1] - read[0], [5.5, clamp, clamp + rise], within=5e-5)


@pytest.mark.parametrize("n_spans", [3, 4, 5])
@pytest.mark.parametrize("topology", ["simple", "stitched", "compound", "single"])
def test_two_sections_of_an_overlap_are_each_other_s_mirror_image(
    topology: str, n_spans: int
) -> None:
    """Both hang as wanted, level where they meet, and carry the weight of what hangs there."""
    n = n_spans + 4
    data = single() if topology == "single" else data_of(topology, n)
    if topology == "single":
        spans = {"span_lengths": (30.0,) * n, "dropper_positions": ((),) * n, "pre_sag": ((),) * n}
        data = replace(data, **spans, stagger=(0.0,) * (n + 1))  # type: ignore[arg-type]
    line = make_line(replace(data, overlaps=Overlaps((2,), n_spans, 0.6, 0.4)))
    mesh, form = at_rest(line, 2)
    length = float(line.support_positions[-1])
    for name in {wire.name.removesuffix("_next") for wire in line.wires}:
        nodes, others = mesh.wires[name], mesh.wires[of_next(name)][::-1]
        check("mirrored x [m]", mesh.x(others), length - mesh.x(nodes), within=1e-6)
        check("mirrored height [m]", form.height[others], form.height[nodes], within=1e-7)
        apart = np.interp(length / 2, mesh.x(nodes), mesh.points[nodes, 1])
        assert apart == pytest.approx(0.2 if line.wire(name).role is not Role.STITCH else apart)
    assert form.dropper_force.min(initial=20.0) > 5.0
    profile = line.wire(CONTACT_WIRE).profile
    assert profile is not None and profile.rises
    step = (0.5 * length, line.support_positions[2 + n_spans])
    check(
        "level, risen [m]", profile.level(np.array(step)) - profile.height, [0.0, 0.6], within=1e-12
    )
    ends = [piece.x for wire in line.wires_of(Role.CONTACT) for piece in wire.pieces]
    assert ends[0][-1] == step[1] and ends[1][0] == line.support_positions[2]


@pytest.mark.parametrize("topology", ["simple", "stitched"])
def test_each_of_several_overlaps_hangs_as_it_does_alone(topology: str) -> None:
    """What is a span and a half from the middle of an overlap feels the next one, a span further,
    through supports alone: some 100 N more press one down by 0.2 mm, of which it passes on T/(kL),
    6e-4, to the next."""
    first, n_spans, n = (2, 6, 10), 3, 15
    data = data_of(topology, n)
    line = make_line(replace(data, overlaps=Overlaps(first, n_spans, 0.6, 0.4)))
    mesh, form = at_rest(line, 2)
    masts = line.support_positions
    for number, span in enumerate(first):
        alone = make_line(replace(data, overlaps=Overlaps((span,), n_spans, 0.6, 0.4)))
        its_mesh, its_form = at_rest(alone, 2)
        middle = 0.5 * (masts[span] + masts[span + n_spans])
        for wire in make_line(data).wires:
            for before in (True, False):
                own = wire.name if (number % 2 == 0) == before else of_next(wire.name)
                its = wire.name if before else of_next(wire.name)
                found, expected = (
                    near(a_mesh, a_form, name, middle, 1.5 * 50.0)
                    for a_mesh, a_form, name in ((mesh, form, own), (its_mesh, its_form, its))
                )
                check(f"{own} [m]", found, expected, within=1e-6)


def near(mesh: LineMesh, form: Equilibrium, wire: str, middle: float, reach: float) -> np.ndarray:
    """Places, lateral positions and heights of a wire within a reach of a place, (3, n) [m]."""
    nodes = mesh.wires[wire][np.abs(mesh.x(mesh.wires[wire]) - middle) < reach]
    return np.stack([mesh.x(nodes), np.abs(mesh.points[nodes, 1]), form.height[nodes]])


def test_wires_of_three_sections_run_where_they_should() -> None:
    """Sections take turns between two wires, each level where it is alone."""
    data = ac_simple_line(15)
    line = make_line(replace(data, overlaps=Overlaps((2, 8), 4, 0.6, 0.4)))
    masts = line.support_positions
    odd, even = (line.wire(name) for name in (CONTACT_WIRE, of_next(CONTACT_WIRE)))
    assert [(own.x[0], own.x[-1]) for own in odd.pieces] == [
        (masts[0], masts[6]),
        (masts[8], masts[15]),
    ]
    assert [(own.x[0], own.x[-1]) for own in even.pieces] == [(masts[2], masts[12])]
    for wire, level, risen in ((odd, (3, 12), (6, 8)), (even, (5, 9), (2, 12))):
        assert wire.profile is not None
        found = wire.profile.level(masts[list((*level, *risen))]) - wire.profile.height
        check("level, risen [m]", found, [0.0, 0.0, 0.6, 0.6], within=1e-12)


def test_wires_in_an_overlap_are_in_equilibrium() -> None:
    """Over a whole line, supports, arms' weights and ends' slopes balance what weighs."""
    data = replace(ac_simple_line(15), overlaps=Overlaps((2, 8), 4, 0.6, 0.4))
    line = make_line(data)
    mesh, form = at_rest(line, 3)
    model, _ = find_form(problem_of(line), mesh)
    weight = -float(model.weight[model.dofs(np.arange(mesh.n_nodes))].sum())
    tops = np.array([line.wire(group.wire).points(np.array([x]))[0, 2]
                     for group in line.supports for x in group.x])  # fmt: skip
    places = np.concatenate([group.x for group in line.supports])
    nodes = [mesh.supports[mesh.support_group == k] for k in range(len(line.supports))]
    at = np.concatenate(nodes)
    np.testing.assert_allclose(mesh.x(at), places, atol=1e-6)
    held = float((line.supports[0].stiffness * (tops - form.height[at])).sum())
    for wire in line.wires:
        pieces = mesh.pieces(wire.name)
        ends = [(own[0], own[1], -1.0) for own in pieces] + [
            (own[-1], own[-2], 1.0) for own in pieces
        ]
        for end, inner, out in ends:
            h = abs(float(np.diff(mesh.x(np.array([end, inner])))[0]))
            u = np.array([form.height[inner], out * form.slope[inner], form.height[end],
                          out * form.slope[end]])  # fmt: skip
            row = beam.stiffness(np.array([h]), wire.bending_stiffness, np.array([wire.tension]))
            load = GRAVITY * wire.mass_per_length * beam.uniform_load(np.array([h]))[0]
            held += float(row[0][2] @ u) + load[2]
    check("vertical balance [N]", held, weight, within=1e-8 * wire.tension)
