"""Staggered lines that go on beyond their ends: every second span is the mirror image of the first.

A short line is the middle of a long one, sideways as well as up, as long as nothing comes back
from the ends of the long one.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from going_on import EN, heights
from measuring import check
from small_lines import HANGING, ac_simple_line, mesh_of, numerics, problem_of, train

from catenary import InputError
from catenary.solver.effects.build_model import build
from catenary.solver.ends import END, START, chain_at, half_lines, span_between
from catenary.solver.model.loads import ShapeLoad, table
from catenary.solver.model.model import Model
from catenary.solver.model.rest_shape import Equilibrium, LateralShape
from catenary.solver.problem.ends import EndCondition, Fixed, Periodic
from catenary.solver.problem.problem import Damping
from catenary.solver.statics.form_finding import find_form
from catenary.solver.waves.reflection import end_reflection

STEPS, DT, SPAN, SHORT, BESIDE = 500, 2e-3, 55.0, 4, 3
EFFECTS = HANGING | {"lateral_motion", "structural_damping", "periodic_ends"}
GOES_ON, HELD = (Periodic(), Periodic()), (Fixed(), Fixed())


def struck(
    n_spans: int, ends: tuple[EndCondition, EndCondition], before: int = 0, found: bool = False
) -> Model:
    """A zig-zag line that a blow upwards and to the left strikes in a span.

    With its rest ``found`` wires hang as they do between ends that are held; otherwise in a shape
    that is the same from span to span: chords, like forces of droppers, like forces of arms.
    """
    line = ac_simple_line(n_spans)
    side = (-1.0) ** before
    stagger = tuple(side * place for place in line.stagger)
    arm = replace(line.steady_arm, inclination=np.deg2rad(10.0))
    line = replace(line, stagger=stagger, steady_arm=arm)
    mesh, duration = mesh_of(line, 2), STEPS * DT
    problem = problem_of(
        line,
        EFFECTS,
        damping=EN,
        numerics=numerics(DT),
        ends=ends,
        train=train(1.0, 0.0, duration * (1.0 + 1e-6)),
    )
    if found:
        model, _ = find_form(problem, mesh)
    else:
        places = np.interp(mesh.points[:, 0], line.support_positions, stagger)
        places[mesh.wires["messenger_wire"]] = 0.0
        pulls = 320.0 * np.sign(places[mesh.steady_arms])
        lift = np.full(pulls.size, 320.0 * np.tan(np.deg2rad(10.0)))
        arms = np.stack([pulls, lift, np.zeros(pulls.size)], axis=1)
        n, none = len(mesh.droppers), np.zeros(mesh.n_nodes)
        lateral = LateralShape(places, none, arms)
        level = np.where(mesh.points[:, 2] > 5.5, 6.28, 5.08)
        form = Equilibrium(level, none, np.full(n, 60.0), np.ones(n), lateral=lateral)
        model = build(problem, mesh, np.ones(n), form=form)
    nodes = model.contact_nodes
    node = nodes[[np.argmin(np.abs(mesh.x(nodes) - (SPAN * before + 21.75)))]]
    blow = table([0.0, 0.01, 0.03, 0.06], [0.0, 1.0, -0.5, 0.0])
    for name, force in (("w", 100.0), ("v", 70.0)):
        model.loads.append(ShapeLoad(model.dofs(node, name), np.array([force]), blow))
    return model


def sideways(model: Model, first: float, last: float) -> np.ndarray:
    """Lateral displacement of the contact wire from ``first`` to ``last`` [m] at the end."""
    return heights(model, STEPS, first, last, name="v")[-1]


@pytest.mark.parametrize(
    ("found", "within"), [(False, 1e-8), pytest.param(True, 1e-8, marks=pytest.mark.study)]
)
def test_a_short_zig_zag_moves_as_the_middle_of_a_long_one(found: bool, within: float) -> None:
    """To the round-off of the end's memory where spans are mirror images; at a rest that is found
    the last span hangs a little otherwise than the ones that go on, by so much."""
    short = struck(SHORT, GOES_ON, found=found)
    long = struck(SHORT + 2 * BESIDE, HELD, BESIDE, found)
    part = BESIDE * SPAN, (BESIDE + SHORT) * SPAN
    expected, ours = heights(long, STEPS, *part), heights(short, STEPS, 0.0, SHORT * SPAN)
    largest = np.abs(expected).max()
    check("uplift", ours / largest, expected / largest, within=within)
    expected = sideways(long, *part)
    largest = np.abs(expected).max()
    check("sideways", sideways(short, 0.0, SHORT * SPAN) / largest, expected / largest,
          within=within)  # fmt: skip
    if not found:
        held = heights(struck(SHORT, HELD), STEPS, 0.0, SHORT * SPAN)
        assert np.abs(held - ours).max() > 0.1 * np.abs(ours).max()


def undamped(model: Model) -> Model:
    still = replace(model.simulated, damping=Damping(0.0, 0.0))
    return replace(model, simulated=still)


@pytest.mark.parametrize("side", [START, END])
def test_waves_of_a_zig_zag_are_those_of_two_spans_of_it(side: int) -> None:
    """Spans that are mirror images in turn have the group velocities of a line whose period is two
    of them; an end that is held keeps the energy, and one that goes on sends nothing back."""
    frequency = np.arange(3.0, 12.0, 1.5)
    model, beyond = undamped(struck(5, HELD)), undamped(struck(5, GOES_ON))
    held = end_reflection(model, side, frequency)
    goes_on = end_reflection(beyond, side, frequency)
    growth = 1e-3
    s = growth + 2j * np.pi * frequency
    free = replace(model, constrained=model.numbering.missing)
    chain = chain_at(
        span_between(free, SPAN, 3.0 * SPAN)[1], np.stack([s**2, s, np.ones_like(s)], axis=1)
    )
    after, _ = half_lines(chain)
    back = np.swapaxes(chain.next, 1, 2)
    factors = np.linalg.eigvals(-np.linalg.solve(after - chain.end, back))
    speed = -growth * 2.0 * SPAN / np.log(np.abs(factors))
    for ours, of_two in zip(held.group_velocity, speed, strict=True):
        expected = np.sort(of_two[of_two > 20.0])
        check("group velocity", np.sort(ours[ours > 20.0]), expected, within=1e-3 * expected)
    fast = held.group_velocity > 40.0
    # Waves fade by exp(-1e-3 L / v) on the way, as those of a line that is level.
    check("held", held.reflected[fast], 1.0, within=5e-3)
    assert np.nanmax(goes_on.reflected) < 1e-8


def test_masts_of_the_line_beyond_hold_the_messenger_wire_at_the_end() -> None:
    """Its supports do so sideways; the contact wire is on bars there, and free."""
    model = struck(SHORT, GOES_ON)
    ends = {name: nodes[[0, -1]] for name, nodes in model.mesh.wires.items()}
    held = {
        name: np.isin(model.dofs(nodes, "v"), model.constrained) for name, nodes in ends.items()
    }
    assert held["messenger_wire"].all() and not held["contact_wire"].any()


def test_spans_of_another_stagger_do_not_go_on() -> None:
    line = ac_simple_line(4)
    line = replace(line, stagger=(0.2, -0.2, 0.2, -0.2, 0.4))
    problem = problem_of(line, EFFECTS, ends=(Fixed(), Periodic()))
    with pytest.raises(InputError, match="the last one is of another kind$"):
        find_form(problem, mesh_of(line, 2))
