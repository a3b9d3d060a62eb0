"""The line at rest with droppers as they were cut, against equilibria in absolute heights."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from measuring import check, march, matrix_of, registered
from scipy import integrate
from small_lines import HANGING, WHOLE, ac_simple_line, en50318_line, mesh_of, problem_of, train
from static_line import absolute_rest, first_rest

from catenary.meshgen.line import DropperPlace
from catenary.meshgen.mesh import CONTACT_WIRE, MESSENGER_WIRE, LineMesh
from catenary.meshgen.wires import worn_round
from catenary.solver.effects.effect import Effect
from catenary.solver.model import beam
from catenary.solver.model.builder import ModelBuilder
from catenary.solver.model.link_directions import between_nodes
from catenary.solver.model.links import PULLS, law
from catenary.solver.model.model import Model
from catenary.solver.model.rest_shape import Equilibrium
from catenary.solver.problem.defects import (
    Defect,
    HardSpot,
    Heights,
    Irregularities,
    LengthErrors,
    LooseClamp,
    MissingDropper,
    WornWire,
    WrongTension,
)
from catenary.solver.problem.problem import Problem
from catenary.solver.statics.form_finding import find_form

SLACKENING = frozenset({"dropper_slackening"})
EFFECTS = frozenset(
    {
        "contact_wire_height",
        "dropper_lengths",
        "missing_dropper",
        "loose_clamp",
        "worn_wire",
        "wrong_tension",
        "hard_spot",
    }
)
LINE = ac_simple_line(3)
MIDDLE = 82.5  # the dropper in the middle of the line


def hung(
    *defects: Defect, lengths: LengthErrors | None = None, heights: Heights | None = None
) -> tuple[Problem, LineMesh, Model, Equilibrium]:
    problem = problem_of(
        LINE,
        HANGING | SLACKENING | EFFECTS,
        defects=defects,
        irregularities=Irregularities(heights=heights, lengths=lengths),
    )
    mesh = mesh_of(LINE, 3)
    return problem, mesh, *find_form(problem, mesh)


def sound() -> tuple[Model, Equilibrium]:
    return find_form(problem_of(LINE, HANGING | SLACKENING), mesh_of(LINE, 3))


def heights_of(model: Model, form: Equilibrium) -> np.ndarray:
    return first_rest(model, form)


def given(*errors: tuple[float, float]) -> LengthErrors:
    return LengthErrors(0.0, 3.0, 1, tuple((DropperPlace(x), error) for x, error in errors))


def test_one_dropper_10_mm_short_lifts_the_wire_by_an_influence_line() -> None:
    """All droppers stay taut: with G the motion under a pair of unit forces at the ends of that
    dropper, of a line without it, the stretch e = F (1/k + G) = 10 mm gives the force F that comes
    on top, and F times the influence line what the wires move by."""
    model, first = sound()
    _, mesh, _, form = hung(lengths=given((MIDDLE, -0.010)))
    assert (form.dropper_force > 0.0).all()
    number = int(np.argmin(np.abs(mesh.x(mesh.droppers[:, 1]) - MIDDLE)))
    dense = np.zeros((model.n_dofs, model.n_dofs))
    for block in model.blocks:
        if block.stiffness is not None:
            for own, matrix in zip(block.dofs, block.stiffness[block.kind], strict=True):
                dense[np.ix_(own, own)] += matrix
    pull, k = np.zeros(model.n_dofs), model.dropper_stiffness[number]
    pull[model.dofs(mesh.droppers[number])] = 1.0, -1.0
    dense -= k * np.outer(pull, pull)
    free = np.setdiff1d(np.arange(model.n_dofs), model.constrained)
    moved = np.zeros(model.n_dofs)
    moved[free] = np.linalg.solve(dense[np.ix_(free, free)], pull[free])
    more = 0.010 / (1.0 / k + pull @ moved)
    change = heights_of(model, form) - heights_of(model, first)
    # The dropper weighs less by what it is shorter; a line gives way by less than 1 mm/N.
    weight = 9.81 * 0.117 * 0.010
    own = form.dropper_force[number] - first.dropper_force[number]
    check("dropper force [N]", own, more, within=weight)
    check("heights [m]", change, -more * moved, within=1e-3 * weight)
    lifted = change[model.dofs(mesh.droppers[number, 1])]
    assert 0.003 < lifted < 0.010, lifted


@pytest.mark.parametrize("error", [0.010, 0.1, -0.1])
def test_lengths_as_cut_rest_as_absolute_heights_do(error: float) -> None:
    """Errors of 100 mm leave droppers slack: which ones, a second solution finds by itself."""
    lengths = replace(
        given((MIDDLE, error), (20.5, -error)), deviation=abs(error) / 4, cut_off=2.0, seed=7
    )
    _, _, model, form = hung(lengths=lengths)
    tensions = {CONTACT_WIRE: 22e3, MESSENGER_WIRE: 16e3}
    taut = replace(model, dropper_gap=np.zeros_like(model.dropper_gap))
    expected = absolute_rest(taut, form, tensions=tensions, broken=set())
    check("heights [m]", heights_of(model, form), expected, within=1e-9)
    slack = form.dropper_force == 0.0
    assert slack.any() == (abs(error) > 0.05)
    assert not np.signbit(form.dropper_force).any()  # tables would show -0.000 N
    assert np.array_equal(slack, model.dropper_gap > 0.0)
    upper, lower = model.mesh.droppers.T
    stretch = form.height[upper] - form.height[lower] - form.dropper_length
    check("forces [N]", form.dropper_force, np.where(slack, 0.0, 1e5 * stretch), within=1e-4)
    check("gaps [m]", model.dropper_gap, np.where(slack, -stretch, 0.0), within=1e-9)


@pytest.mark.parametrize("kind", [MissingDropper, LooseClamp])
def test_without_a_dropper_the_line_rests_as_absolute_heights_do(kind: type) -> None:
    model, first = sound()
    _, mesh, changed, form = hung(kind(DropperPlace(MIDDLE)))
    number = int(np.argmin(np.abs(mesh.x(mesh.droppers[:, 1]) - MIDDLE)))
    tensions = {CONTACT_WIRE: 22e3, MESSENGER_WIRE: 16e3}
    bare = replace(changed, broken=np.zeros_like(changed.broken))
    expected = absolute_rest(bare, form, tensions=tensions, broken={number})
    check("heights [m]", heights_of(changed, form), expected, within=1e-9)
    assert form.dropper_force[number] == 0.0
    dropped = LINE.dropper
    own = dropped.upper_clamp_mass + dropped.lower_clamp_mass
    own += dropped.mass_per_length * model.dropper_lengths[number]
    lost = 9.81 * own if kind is MissingDropper else 0.0
    check("weight lost [N]", changed.weight.sum() - model.weight.sum(), lost, within=1e-9)
    # The wire sinks where nothing holds it, by its neighbours' stretch and its own sag.
    assert -0.05 < form.height[mesh.droppers[number, 1]] - first.height[mesh.droppers[number, 1]]
    assert form.height[mesh.droppers[number, 1]] < first.height[mesh.droppers[number, 1]] - 0.003


def test_a_wrong_tension_at_the_installation() -> None:
    _, _, model, form = hung(WrongTension(CONTACT_WIRE, 0.9))
    tensions = {CONTACT_WIRE: 0.9 * 22e3, MESSENGER_WIRE: 16e3}
    check("tension [N]", model.problem.line.wire(CONTACT_WIRE).tension, 0.9 * 22e3, within=1e-9)
    expected = absolute_rest(model, form, tensions=tensions, broken=set())
    check("heights [m]", heights_of(model, form), expected, within=1e-9)


def test_a_worn_stretch_is_lighter_and_softer() -> None:
    """A stretch that begins and ends within elements: the mass lost is the stretch's own."""
    model, first = sound()
    _, mesh, changed, form = hung(WornWire(CONTACT_WIRE, 60.3, 97.1, 0.2))
    lost = 9.81 * 0.2 * 1.35 * (97.1 - 60.3)
    check("weight lost [N]", changed.weight.sum() - model.weight.sum(), lost, within=1e-9)
    # In absolute heights, with the matrices put together anew.
    stiffness = np.zeros((changed.n_dofs, changed.n_dofs))
    for wire in LINE_WIRES:
        data = changed.problem.line.wire(wire)
        pairs = mesh.elements(wire)
        dofs, length = changed.wire_elements(wire)
        x = mesh.x(pairs)
        inside = np.clip(np.minimum(x[:, 1], 97.1) - np.maximum(x[:, 0], 60.3), 0.0, None) / length
        left = 1.0 - inside * (1.0 - worn_round(0.2).bending) * (wire == CONTACT_WIRE)
        bent = left[:, None, None] * beam.stiffness(length, data.bending_stiffness, 0.0)
        for own, matrix in zip(dofs, bent + beam.stiffness(length, 0.0, data.tension),
                               strict=True):  # fmt: skip
            stiffness[np.ix_(own, own)] += matrix
    load = changed.weight.copy()
    at = changed.dofs(mesh.supports)
    stiffness[at, at] += 5e5
    load[at] += 5e5 * LINE_TOP
    for (upper, lower), length in zip(changed.dofs(mesh.droppers), form.dropper_length,
                                      strict=True):  # fmt: skip
        own = np.ix_([upper, lower], [upper, lower])
        stiffness[own] += 1e5 * np.array([[1.0, -1.0], [-1.0, 1.0]])
        load[upper] += 1e5 * length
        load[lower] -= 1e5 * length
    held = changed.constrained
    free = np.setdiff1d(np.arange(changed.n_dofs), held)
    expected = heights_of(changed, first)
    load -= stiffness[:, held] @ expected[held]
    expected[free] = np.linalg.solve(stiffness[np.ix_(free, free)], load[free])
    check("heights [m]", heights_of(changed, form), expected, within=1e-9)
    middle = mesh.droppers[len(mesh.droppers) // 2, 1]
    assert form.height[middle] > first.height[middle] + 0.002


LINE_WIRES = (CONTACT_WIRE, MESSENGER_WIRE)
LINE_TOP = LINE.contact_height + LINE.encumbrance


@pytest.mark.parametrize("depth", [0.2, 0.6, 1.1])
def test_bending_of_a_wire_worn_flat_from_below(depth: float) -> None:
    """Integrated over the section that is left, of a circle of radius one."""
    area, first, second = (
        integrate.quad(lambda z, n=n: 2 * np.sqrt(1 - z * z) * z**n, depth - 1.0, 1.0)[0]
        for n in range(3)
    )
    expected = (second - first**2 / area) / (np.pi / 4)
    worn = worn_round(1.0 - area / np.pi)
    check("left of EI", worn.bending, expected, within=1e-7)
    # The flat, at depth - 1, is nearer to the centroid than the top.
    farthest = max(1.0 - first / area, first / area - (depth - 1.0))
    check("surface over the radius", worn.farthest, farthest, within=1e-7)


def test_a_hard_spot_hangs_on_the_wire_and_stands_still_on_its_spring() -> None:
    """The weight of a mass at a node: what absolute heights make of it; half an element on, the
    same weight and moment. The spring carries nothing at rest but resists what follows."""
    model, first = sound()
    x = float(model.mesh.x(model.mesh.droppers[13, 1]))
    _, _, changed, form = hung(HardSpot(CONTACT_WIRE, x, 5.0, 0.0))
    tensions = {CONTACT_WIRE: 22e3, MESSENGER_WIRE: 16e3}
    expected = absolute_rest(changed, form, tensions=tensions, broken=set())
    check("heights [m]", heights_of(changed, form), expected, within=1e-9)
    check("weight [N]", changed.weight.sum() - model.weight.sum(), -9.81 * 5.0, within=1e-9)
    _, _, sprung, form = hung(HardSpot(CONTACT_WIRE, x, 0.0, 500.0))
    check("heights [m]", form.height, first.height, within=1e-12)
    node = int(sprung.dofs(sprung.mesh.droppers[13:14, 1])[0])
    added = matrix_of(sprung, stiffness=1.0) - matrix_of(model, stiffness=1.0)
    check("spring [N/m]", added[node, node], 500.0, within=1e-8)
    # Beside a mass, and under another tension, the spring still carries nothing: the line hangs as
    # without it, and moves with it.
    slack = WrongTension(CONTACT_WIRE, 0.8)
    _, _, without, alone = hung(HardSpot(CONTACT_WIRE, x + 1.3, 5.0, 0.0), slack)
    _, _, sprung, form = hung(HardSpot(CONTACT_WIRE, x + 1.3, 5.0, 500.0), slack)
    check("heights beside a mass [m]", form.height, alone.height, within=1e-12)
    added = matrix_of(sprung, stiffness=1.0) - matrix_of(without, stiffness=1.0)
    lift = sprung.dofs(np.arange(sprung.mesh.n_nodes))
    # A wire lifted as a whole is lifted there: the sum over its heights is that of the spring.
    check("spring beside a mass [N/m]", added[np.ix_(lift, lift)].sum(), 500.0, within=1e-7)


@pytest.mark.parametrize(
    "other", [None, WrongTension(MESSENGER_WIRE, 0.9), MissingDropper(DropperPlace(MIDDLE))]
)
def test_a_spring_carries_nothing_at_rest_whatever_else_moves_the_line(
    other: WrongTension | MissingDropper | None,
) -> None:
    """The mass sinks, and the line goes where its other defect lets it, as without the spring."""
    more = () if other is None else (other,)
    spots = (HardSpot(CONTACT_WIRE, 120.3, 5.0, stiffness) for stiffness in (0.0, 5000.0))
    (_, _, bare, alone), (_, _, sprung, form) = (hung(spot, *more) for spot in spots)
    first = sound()[1]
    assert np.abs(form.height - first.height).max() > 5e-3
    check("heights [m]", form.height, alone.height, within=1e-12)
    check("droppers [N]", form.dropper_force, alone.dropper_force, within=1e-9)
    assert np.array_equal(sprung.dropper_gap, bare.dropper_gap)
    # In motion it resists: a lift of all wires by one, whose elements turn by nothing.
    added = matrix_of(sprung, stiffness=1.0) - matrix_of(bare, stiffness=1.0)
    lift = np.zeros(sprung.n_dofs)
    lift[sprung.dofs(np.arange(sprung.mesh.n_nodes))] = 1.0
    check("spring [N/m]", lift @ (added @ lift), 5000.0, within=1e-6)


def test_irregular_heights_are_met_where_droppers_can_pull() -> None:
    """Droppers are cut for the table's heights: met to rounding while all of them pull."""
    _, first = sound()
    table = ((60.0, 0.0), (82.5, 0.004), (105.0, -0.003), (140.0, 0.0))
    heights = Heights((0.0, 165.0), None, table)
    _, mesh, _, form = hung(heights=heights)
    lower = mesh.droppers[:, 1]
    wanted = heights.at(CONTACT_WIRE, mesh.x(lower))[0]
    assert (form.dropper_force > 0.0).all()
    check("heights [m]", form.height[lower] - first.height[lower], wanted, within=1e-9)
    assert np.abs(form.dropper_force - first.dropper_force).max() > 5.0
    # Where one would have to push, the wire hangs higher than wanted, and the dropper slack.
    deep = Heights((0.0, 165.0), None, ((76.0, 0.0), (82.5, -0.08), (89.0, 0.0)))
    _, _, model, form = hung(heights=deep)
    short = form.height[lower] - first.height[lower] - deep.at(CONTACT_WIRE, mesh.x(lower))[0]
    slack = model.dropper_gap > 0.0
    assert slack.any() and (short[slack] > 0.0).all()


def test_a_dropper_slack_at_rest_is_an_open_link_under_way() -> None:
    """The same march with the dropper loose and, from the tests, a link with a gap in its place.
    Both have the damping of their component when they are closed.

    Far ahead of the train nothing moves; where it passes the link closes and opens.
    """
    line, k = en50318_line(3), 1e5
    near, far = 83.5, 163.0
    lengths = given((near, 0.05), (far, 0.06))
    whole = WHOLE | EFFECTS
    problem = problem_of(
        line,
        whole,
        irregularities=Irregularities(lengths=lengths),
        train=train(70.0, 40.0, 110.0, nominal_height=5.5),
    )
    mesh = mesh_of(line, 2)
    model, form = find_form(problem, mesh)
    slack = np.flatnonzero(model.dropper_gap)
    places = mesh.x(mesh.droppers[slack, 1])
    assert far in places and places.size == 2, places
    history = march(problem, mesh)
    forces = history["dropper_force"]
    assert (forces[:200, slack[-1]] == 0.0).all()
    still = slack[-1] + 1
    check("far ahead [N]", forces[:200, still], form.dropper_force[still], within=1e-6)
    assert forces[:, slack[0]].min() == 0.0 and forces[:, slack[0]].max() > 10.0

    def open_links(builder: ModelBuilder) -> None:
        pairs = between_nodes(builder.model, mesh.droppers[slack])
        gaps = model.dropper_gap[slack]
        builder.add_links("open", pairs, law(places, k, acts=PULLS, gap=gaps))

    loose = tuple(LooseClamp(DropperPlace(float(x))) for x in places)
    with registered(Effect("open_links", "links", "links", "test", False, build=open_links)):
        other = march(replace(problem, effects=whole | {"open_links"}, defects=loose), mesh)
    # Droppers hang with the same lengths, so that both lines rest in the same shape.
    check("contact force [N]", history["contact_force"], other["contact_force"], within=1e-6)
