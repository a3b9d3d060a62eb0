"""The rest of lines in three planes at once against an energy that is written down in the tests."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from axial_lines import HANGING_ALONG, with_stiffness
from measuring import check, matrix_of
from small_lines import ac_simple_line, mesh_of, problem_of
from spatial_line import SpatialLine, shape
from studies import few

from catenary.meshgen.line import Curve
from catenary.meshgen.mesh import CONTACT_WIRE
from catenary.meshgen.topologies.line_data import LineData
from catenary.solver.model.model import Model
from catenary.solver.model.rest_shape import Equilibrium
from catenary.solver.problem.defects import Irregularities, LengthErrors
from catenary.solver.problem.ends import AlongTrack
from catenary.solver.problem.problem import Problem
from catenary.solver.problem.wind import Wind
from catenary.solver.statics.form_finding import find_form

SPATIAL = HANGING_ALONG | {"lateral_motion", "dropper_lengths", "wind"}
ALPHA = 1.7e-5


def staggered_line(curve: Curve | None = None) -> LineData:
    """Two spans with two droppers each, which lean, and arms of ten degrees."""
    line = with_stiffness(ac_simple_line(2))
    assert line.messenger_wire is not None
    return replace(
        line,
        dropper_positions=((15.0, 40.0),) * 2,
        pre_sag=((0.02, 0.02),) * 2,
        # Wires that grow differently, so that droppers lean along the track as well.
        messenger_wire=replace(line.messenger_wire, expansion=0.0, diameter=0.014),
        contact_wire=replace(line.contact_wire, diameter=0.0144),
        steady_arm=replace(line.steady_arm, inclination=np.deg2rad(10.0)),
        curve=curve,
    )


def with_defects(problem: Problem) -> tuple[Model, Equilibrium, Equilibrium, SpatialLine]:
    """The model and its rest, that for which it was cut, and the energy of the line as it hangs."""
    mesh = mesh_of(problem.line, 1)
    sound = replace(problem, effects=problem.effects - {"dropper_lengths", "wind"})
    first = find_form(replace(sound, along=replace(sound.along, warmer=0.0)), mesh)[1]
    model, form = find_form(problem, mesh)
    lengths = first.dropper_length.copy()
    errors = problem.irregularities.lengths if problem.irregularities else None
    if errors is not None:
        lengths += errors.of(lengths.size)
    blown = {}
    if problem.wind is not None:
        for wire in problem.line.wires:
            pressure = 0.5 * problem.wind.density * problem.wind.mean**2
            side = np.sign(problem.wind.direction)
            blown[wire.name] = side * pressure * 1.2 * (wire.diameter or 0.0)
    return model, form, first, SpatialLine(model, first, lengths, blown)


ENDS = AlongTrack(end=True, warmer=50.0)
CASES = {
    "warm between tensioner and anchor": (ENDS, None, None, None),
    "warm in a canted curve": (ENDS, Curve(1 / 800, 0.05), None, None),
    "warm where a transition begins": (ENDS, Curve(1 / 800, 0.05, (30.0, 500.0), 40.0), None, None),
    "warm between anchors": (AlongTrack(warmer=-30.0), None, None, None),
    "droppers cut wrong": (
        AlongTrack(end=True),
        None,
        Irregularities(lengths=LengthErrors(0.004, 2.5, 3, ())),
        None,
    ),
    "blown by the wind": (AlongTrack(end=True), None, None, Wind(20.0, height=10.0)),
    "pushed by a storm": (
        AlongTrack(end=True),
        None,
        None,
        Wind(45.0, height=10.0, direction=-0.5 * np.pi),
    ),
}


@pytest.mark.parametrize(
    "name",
    few(CASES, "droppers cut wrong", "warm where a transition begins", "warm between anchors"),
)
def test_the_rest_in_three_planes_is_where_the_energy_is_least(name: str) -> None:
    along, curve, irregular, wind = CASES[name]
    line = staggered_line(curve)
    problem = problem_of(line, SPATIAL, along=along, wind=wind)
    if irregular is not None:
        problem = replace(problem, irregularities=irregular)
    model, form, first, energy = with_defects(problem)
    if along.end:
        # The weights pull with the tension of the installation.
        for wire in problem.line.wires:
            energy.pulls[int(model.mesh.wires[wire.name][-1])] = wire.tension
    numbers = energy.numbers()
    held = np.isin(numbers, model.constrained)
    expected = energy.rest(shape(first), held)
    found = shape(form)
    moved = np.abs(expected - shape(first)).max()
    assert moved > 2e-3
    # An arm that its wire pushes has a tension below zero, and so has its geometric stiffness.
    assert form.lateral is not None
    assert (form.lateral.arm_tension < 0.0).any() == (name == "pushed by a storm")
    # Of forces of 2e4 N, whose sum is zero to the rounding of finite differences.
    check("shape [m]", found, expected, within=1e-8)
    left = energy.gradient(found)[~held]
    check("force left [N]", left, 0.0, within=1e-8 * 22e3)
    if name == "warm where a transition begins":
        # Matrices leave out what the twist couples between the planes in motion.
        return
    wanted = energy.hessian(found)[np.ix_(~held, ~held)]
    tangent = matrix_of(model, stiffness=1.0).toarray()[np.ix_(numbers, numbers)]
    check("stiffness", tangent[np.ix_(~held, ~held)], wanted, within=1e-8 * np.abs(wanted).max())


def zig_zag(n: int, along: AlongTrack) -> tuple[Model, Equilibrium]:
    """A staggered line with its messenger wire above the contact wire, warmer or not."""
    line = with_stiffness(ac_simple_line(n))
    line = replace(line, messenger_stagger=line.stagger)
    return find_form(problem_of(line, SPATIAL - {"wind"}, along=along), mesh_of(line, 2))


def test_a_staggered_line_with_tensioners_keeps_its_tension_and_its_arms_swing() -> None:
    """The end moves alpha dT L, weights hold the tension. An arm swings by what the wire travels
    there, which pulls its clamp x^2 / 2 l to its hinge, and takes P x / l off the tension."""
    n, warmer, length = 8, 40.0, 1.22
    model, form = zig_zag(n, AlongTrack(end=True, warmer=warmer))
    _, installed = zig_zag(n, AlongTrack(end=True))
    mesh, arms = model.mesh, model.mesh.steady_arms
    assert form.lateral is not None and installed.lateral is not None
    gained = form.gained_tension[CONTACT_WIRE]
    check("tension at the weights [N]", gained[-1], 0.0, within=1e-6)
    # What arms and droppers take off the tension shortens the wire by 1e-5 of its length.
    loss = float(np.abs(gained).max())
    stretched = loss / 18e6 * 55.0 * n
    moved = ALPHA * warmer * mesh.x(arms)
    check("travel [m]", form.along[arms], moved, within=stretched)
    slew = form.along[arms] / length
    # The bar's length stays, but for what 1e7 N/m give.
    sideways, upwards, along = length * installed.lateral.arm_direction.T
    level, upward = np.hypot(sideways, along), upwards.copy()
    upward -= (form.height - installed.height)[arms]
    swung = level - np.sqrt(length**2 - form.along[arms] ** 2 - upward**2)
    sides = np.sign(installed.lateral.arm_force[:, 0])
    pulled = sides * (form.lateral.y - installed.lateral.y)[arms]
    check("to the hinge [m]", pulled, swung, within=5e-5)
    travel = form.along[arms]
    check("x^2 / 2 l [m]", pulled, travel**2 / (2 * length), within=0.02 * pulled.max())
    sideways, _, ahead = form.lateral.arm_direction.T
    check("slew [rad]", np.arctan2(ahead, np.abs(sideways)), -slew, within=0.02 * slew.max())
    # From arm to arm the tension falls by the arm's force along the track.
    along = form.lateral.arm_force[:, 2]
    radial = np.hypot(form.lateral.arm_force[:, 0], along)
    check("force along [N]", along, -radial * np.sin(slew), within=0.02 * np.abs(along).max())


@pytest.mark.parametrize("warmer", [-20.0, 40.0])
def test_a_staggered_line_between_anchors_loses_ea_alpha_dt(warmer: float) -> None:
    """Less what the sag gives: T - (q l)^2 EA / 24 T^2 of a wire that hangs by short droppers, and
    EA v (4 a / L) / L of arms whose clamps move sideways by v at each kink."""
    model, form = zig_zag(4, AlongTrack(warmer=warmer))
    _, installed = zig_zag(4, AlongTrack())
    assert form.lateral is not None and installed.lateral is not None
    gained, mesh = form.gained_tension[CONTACT_WIRE], model.mesh
    nodes = mesh.wires[CONTACT_WIRE]
    courses = [(shape.height[nodes], shape.lateral.y[nodes]) for shape in (installed, form)]
    h = np.diff(mesh.x(nodes))
    longer = [sum((np.diff(part) ** 2 / (2 * h)).sum() for part in both) for both in courses]
    strain = (longer[1] - longer[0]) / h.sum() - ALPHA * warmer
    check("EA alpha dT [N]", gained, -18e6 * ALPHA * warmer, within=0.06 * np.abs(gained).max())
    # Chords of elements for their arcs.
    check("EA strain [N]", gained.mean(), 18e6 * strain, within=3e-3 * np.abs(gained).max())
    assert np.ptp(gained) < 2e-3 * np.abs(gained).max()
