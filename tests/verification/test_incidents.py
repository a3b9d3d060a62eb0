"""Droppers that break and wires that lose tension during a run."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from measuring import (
    COMM,
    check,
    check_continued,
    continued,
    free_matrices,
    march,
    order_of_march,
)
from scipy import linalg
from small_lines import (
    FREE_MASS,
    HANGING,
    WHOLE,
    bare_wires,
    en50318_line,
    mesh_of,
    numerics,
    problem_of,
    train,
)
from static_line import absolute_rest, first_rest
from studies import few_values

from catenary.cases.studies.hard import runs as hard_runs
from catenary.meshgen.line import DropperPlace
from catenary.meshgen.mesh import CONTACT_WIRE, MESSENGER_WIRE
from catenary.solver.model.beam import shape_slopes
from catenary.solver.model.model import Model
from catenary.solver.problem.contact_laws import HertzLaw, KinematicLaw, LinearLaw
from catenary.solver.problem.defects import (
    DropperBreak,
    Happened,
    LineIncident,
    TensionLoss,
    in_steps,
)
from catenary.solver.problem.problem import Damping, Problem, Train
from catenary.solver.statics.after_incidents import changed_line
from catenary.solver.statics.form_finding import find_form
from catenary.solver.statics.line_at_rest import line_at_rest

EPS = np.finfo(float).eps
INCIDENTS = {"dropper_break", "tension_loss"}
BREAK = DropperBreak(0.2, DropperPlace(90.0))
# Near critical for the line's slowest motion, at about 1 Hz; stiffness damps what is fast.
STRONG = Damping(alpha=5e-3, beta=12.0)
SETTLED = 6.0
METHODS: dict[str, dict[str, Any]] = {
    "average acceleration": {},
    "generalized alpha": {"integrator": "generalized_alpha", "spectral_radius": 0.8},
}


def nobody(duration: float) -> Train:
    """A train whose head stays 2 m below the wire for ``duration`` [s]."""
    far_below = train(20.0, 20.0, 20.0 + 20.0 * duration, data=FREE_MASS, static_force=1.0)
    return replace(far_below, raise_time=1e6, start_below=2.0)


@pytest.mark.parametrize(
    "incidents",
    [
        pytest.param((BREAK,), marks=pytest.mark.study),
        (BREAK, DropperBreak(0.4, DropperPlace(96.5)), DropperBreak(0.3, DropperPlace(60.0 + 5.0))),
        (TensionLoss(0.2, CONTACT_WIRE, 0.6),),
        pytest.param((TensionLoss(0.2, MESSENGER_WIRE, 0.8),), marks=pytest.mark.study),
        (TensionLoss(0.2, CONTACT_WIRE, 0.9), BREAK, TensionLoss(0.7, CONTACT_WIRE, 0.5)),
    ],
    ids=["a dropper", "three droppers", "contact wire", "messenger wire", "all of it"],
)
def test_the_line_comes_to_rest_where_statics_wants_it(incidents: tuple[LineIncident, ...]) -> None:
    line = en50318_line(3)
    mesh = mesh_of(line, 3)
    problem = problem_of(
        line,
        frozenset(WHOLE | INCIDENTS),
        damping=STRONG,
        train=nobody(SETTLED),
        numerics=numerics(2e-3),
        incidents=incidents,
    )
    model, form = find_form(problem, mesh)
    seen = march(problem, mesh, lambda view: (view.step % 100 == 0) and view.checkpoint())
    moved = seen.watched[-1]["displacement"]
    shares = {CONTACT_WIRE: 1.0, MESSENGER_WIRE: 1.0}
    broken = set()
    places = mesh.x(mesh.droppers[:, 1])
    for incident in incidents:
        if isinstance(incident, TensionLoss):
            shares[incident.wire] = incident.share
        else:
            broken.add(int(np.flatnonzero(np.abs(places - incident.place.x) < 1e-9)[0]))
    tensions = {wire: share * problem.line.wire(wire).tension for wire, share in shares.items()}
    expected = absolute_rest(model, form, tensions=tensions, broken=broken) - first_rest(
        model, form
    )
    largest = np.abs(expected).max()
    assert largest > 2e-3  # the line does hang elsewhere now
    # What is left of amplitudes of the size of the way itself since the last incident, 0.7 s after
    # the start at most; and round-off of heights of 6 m by matrices of a condition of 1e5.
    left = np.exp(-slowest_decay(changed_line(model, form, incidents).model) * (SETTLED - 0.7))
    within = 10 * left * largest + 1e5 * EPS * 6.0
    assert within < 1e-4 * largest
    check("rest [m]", moved, expected, within=within)
    force = seen["dropper_force"][-1]
    assert all(force[list(broken)] == 0.0)
    order = np.setdiff1d(np.arange(force.size), list(broken))
    stretch = (first_rest(model, form) + expected)[model.dofs(mesh.droppers)]
    taut = 1e5 * np.maximum(stretch[:, 0] - stretch[:, 1] - form.dropper_length, 0.0)
    check("dropper forces [N]", force[order], taut[order], within=1e5 * 2 * within)


def slowest_decay(model: Model) -> float:
    """Rate of the motion that dies out last under proportional damping [1/s].

    s^2 + (alpha w^2 + beta) s + w^2 = 0 for every natural frequency w.
    """
    mass, stiffness = free_matrices(model)
    square = linalg.eigh(stiffness.toarray(), mass.toarray(), eigvals_only=True)
    half = 0.5 * (STRONG.alpha * square + STRONG.beta)
    return float((half - np.sqrt(np.maximum(half**2 - square, 0.0))).min())


def test_sag_grows_as_tension_falls() -> None:
    """A wire of one span: its sag q L^2 / 8 T is the first one over the share that is left.

    Bending, pinned ends, takes q EI / T^2 off at most, and its edges are not resolved by elements
    of 2 m, which is of that size again.
    """
    length, share = 60.0, 0.5
    line = bare_wires(length)
    mesh = mesh_of(line, 30)
    problem = problem_of(
        line,
        frozenset(HANGING | {"structural_damping", "contact_loss"} | INCIDENTS),
        damping=STRONG,
        train=replace(nobody(SETTLED), start=0.0, end=10.0 * SETTLED, speed=10.0),
        numerics=numerics(2e-3),
        incidents=(TensionLoss(0.2, CONTACT_WIRE, share),),
    )
    model, form = find_form(problem, mesh)
    end = march(problem, mesh, lambda view: (view.step % 100 == 0) and view.checkpoint())
    nodes = mesh.wires[CONTACT_WIRE]
    middle = nodes[np.argmin(np.abs(mesh.x(nodes) - length / 2))]
    wire = line.contact_wire
    load = problem.gravity * wire.mass_per_length
    before = line.contact_height - form.height[middle]
    after = before - end.watched[-1]["displacement"][model.dofs(np.array([middle]))[0]]
    bending = load * wire.bending_stiffness / wire.tension**2
    check("sag before [m]", before, load * length**2 / (8 * wire.tension), within=2 * bending)
    expected = load * length**2 / (8 * share * wire.tension)
    check("sag after [m]", after, expected, within=2 * bending / share**2)
    other = np.setdiff1d(np.arange(model.n_dofs), model.dofs(nodes))
    other = np.setdiff1d(other, model.dofs(nodes, "theta_y"))
    assert not end.watched[-1]["displacement"][other].any()  # the messenger wire is not touched


def undamped(incidents: tuple[LineIncident, ...]) -> Problem:
    """A train that presses against a line without damping on which incidents happen."""
    line = en50318_line(4)
    return problem_of(
        line,
        frozenset(HANGING | {"contact_loss"} | INCIDENTS),
        train=train(50.0, 70.0, 130.0, raise_time=0.2),
        numerics=numerics(1e-3),
        incidents=incidents,
    )


@pytest.mark.parametrize(
    "incident",
    [
        DropperBreak(0.4, DropperPlace(90.0)),
        TensionLoss(0.5, CONTACT_WIRE, 0.7),
        TensionLoss(0.5, MESSENGER_WIRE, 0.7),
    ],
    ids=["a dropper", "contact wire", "messenger wire"],
)
def test_the_energy_that_leaves_is_what_broke_or_ran_out(incident: LineIncident) -> None:
    """Energy less work stays, but for T^2 / 2k of the dropper or the tensioner's share of it."""
    problem = undamped((incident,))
    mesh = mesh_of(problem.line, 3)
    rest = line_at_rest(problem, mesh)
    run = hard_runs.run(rest, COMM, with_work=True)
    assert run.outcome == "done"
    at = round(incident.time / problem.numerics.dt)
    seen = march(problem, mesh, lambda view: view.step == at and view.checkpoint())
    if isinstance(incident, DropperBreak):
        number = int(np.argmin(np.abs(mesh.x(mesh.droppers[:, 1]) - incident.place.x)))
        force = seen["dropper_force"][:, number]
        assert force[at] > 50.0 and not force[at + 1 :].any()
        released = force[at] ** 2 / (2 * problem.line.droppers[0].kind.stiffness)
    else:
        shape = first_rest(rest.model, rest.form) + seen.watched[at]["displacement"]
        released = (1 - incident.share) * slope_energy(problem, rest.model, shape, incident.wire)
    balance = run.energy - run.work
    exchanged = max(np.abs(run.energy).max(), np.abs(run.work).max())
    # Round-off of some thousand steps, each of eps of what is added up.
    within = run.time.size * 10 * EPS * exchanged
    check("before [J]", balance[: at + 1], balance[0], within=within)
    check("after [J]", balance[at + 1 :], balance[0] - released, within=within)
    print(f"released {released:.4g} J of {exchanged:.4g} J")
    assert released > 1e4 * within


def slope_energy(problem: Problem, model: Model, shape: np.ndarray, wire: str) -> float:
    """1/2 T integral of z'^2 of a wire by Gauss's rule of four points, exact for cubics [J]."""
    dofs, length = model.wire_elements(wire)
    points, weights = np.polynomial.legendre.leggauss(4)
    total = 0.0
    for own, h in zip(dofs, length, strict=True):
        for point, weight in zip(points, weights, strict=True):
            slope = shape_slopes(0.5 * (1 + point), h) @ shape[own]
            total += 0.5 * weight * h * slope**2
    return float(0.5 * problem.line.wire(wire).tension * total)


@pytest.mark.parametrize(
    "incident",
    [DropperBreak(0.4, DropperPlace(96.5)), TensionLoss(0.4, CONTACT_WIRE, 0.8)],
    ids=["a dropper", "contact wire"],
)
@pytest.mark.parametrize("method", few_values(METHODS, "average acceleration"))
def test_the_march_stays_of_order_2(incident: LineIncident, method: dict[str, Any]) -> None:
    """Contact force of a linear line, against a fine reference, over an incident near the head.

    An acceleration that went through the jump unchanged would make the method of order 1.
    """
    line = en50318_line(3)
    mesh = mesh_of(line, 3)
    problem = problem_of(
        line,
        frozenset(HANGING | {"structural_damping", "contact_damping"} | INCIDENTS),
        contact=LinearLaw(5e4, 50.0),
        train=train(50.0, 70.0, 110.0, raise_time=0.2),
        incidents=(incident,),
    )

    problem = replace(problem, numerics=numerics(1e-3, **method))
    observed, expected = order_of_march(problem, mesh, 3, incident.time)
    # Order 1 is one away; passing from element to element costs up to 0.2, see
    # test_order_in_time.py.
    check("order of the march", observed, expected, within=0.25)


@pytest.mark.parametrize(
    "own",
    [
        {},
        pytest.param({"scheme": "fixed_point"}, marks=pytest.mark.study),
        METHODS["generalized alpha"],
    ],
    ids=["one solve", "fixed point", "generalized alpha"],
)
@pytest.mark.parametrize(
    "at",
    [
        pytest.param(150, marks=pytest.mark.study),
        200,
        201,
        pytest.param(280, marks=pytest.mark.study),
        330,
    ],
    ids=lambda step: f"step {step}",
)
def test_a_continued_run_is_the_uninterrupted_one(own: dict[str, Any], at: int) -> None:
    """From before, between and after incidents, and from the step in which one happens (200)."""
    line = en50318_line(4)
    mesh = mesh_of(line, 3)
    problem = problem_of(
        line,
        frozenset(WHOLE | {"contact_damping"} | INCIDENTS),
        contact=LinearLaw(5e4, 50.0),
        train=train(70.0, 105.0, 133.0, behind=(0.0, 31.0), raise_time=0.1),
        numerics=numerics(1e-3, **own),
        incidents=(
            DropperBreak(0.2, DropperPlace(126.5 - 6.5)),
            TensionLoss(0.3, MESSENGER_WIRE, 0.8),
        ),
    )
    whole, rest = continued(problem, mesh, at)
    assert len(whole.time) == 401
    channels = ("contact_force", "head_height", "wire_height", "dropper_force", "arm_uplift")
    check_continued(whole, rest, at, *channels)


HERTZ = HertzLaw(9e5, 1.5, 0.5, 0.1)
WAYS: dict[str, dict[str, Any]] = {
    "implicit": {},
    "iterated": {"numerics": {"coupling": "iterated", "eps_force": 1e-9}},
    "explicit": {"numerics": {"coupling": "explicit"}},
    "fixed point": {"numerics": {"scheme": "fixed_point"}},
    "generalized alpha": {"numerics": {"integrator": "generalized_alpha", "spectral_radius": 0.8}},
    "hysteresis": {"contact": HERTZ},
    "kinematic": {"contact": KinematicLaw(), "numerics": {"gamma": 0.55, "beta": 0.28}},
}


@pytest.mark.parametrize("way", WAYS.values(), ids=WAYS.keys())
def test_what_happens_far_away_is_not_felt(way: dict[str, Any]) -> None:
    """Contacts, heads and what laws and couplings remember go through an incident unchanged.

    A wave takes 4 s to come from a dropper 490 m away; what the method itself spreads further than
    the equations do falls by 1e-16 within some 40 m.
    """
    line = en50318_line(11)
    mesh = mesh_of(line, 2)
    problem = problem_of(
        line,
        frozenset(WHOLE | {"contact_damping"} | INCIDENTS),
        contact=way.get("contact", LinearLaw(5e4, 50.0)),
        train=train(60.0, 70.0, 106.0, raise_time=0.2),
        numerics=numerics(1e-3, **way.get("numerics", {})),
        incidents=(DropperBreak(0.3, DropperPlace(600.0 - 5.0)),),
    )
    seen = march(problem, mesh)
    expected = march(replace(problem, incidents=()), mesh)
    number = int(np.argmin(np.abs(mesh.x(mesh.droppers[:, 1]) - 595.0)))
    assert not seen["dropper_force"][301:, number].any()
    assert expected["contact_force"][301:].std() > 5.0
    # A line under a constant load takes its steps in another order of sums. Without a depth, forces
    # are heights of 5 m, known to 1e-15 m, over what they move within a step, 1e-6 m/N.
    digits = 1e-10 if isinstance(problem.contact, KinematicLaw) else 1e-12
    for channel in ("contact_force", "head_height", "wire_height"):
        within = digits * np.abs(expected[channel]).max()
        check(channel, seen[channel], expected[channel], within=within)


def test_what_a_scene_leaves_out_does_not_happen() -> None:
    """Without the effects, and after the end of the run, incidents change no bit of it."""
    problem = undamped((DropperBreak(0.4, DropperPlace(90.0)), TensionLoss(0.5, CONTACT_WIRE, 0.7)))
    mesh = mesh_of(problem.line, 2)
    problem = replace(problem, train=replace(problem.train, end=102.0))
    without = march(replace(problem, incidents=()), mesh)["contact_force"]
    off = march(replace(problem, effects=problem.effects - INCIDENTS), mesh)["contact_force"]
    late = tuple(replace(incident, time=2.0) for incident in problem.incidents)
    never = march(replace(problem, incidents=late), mesh)["contact_force"]
    assert (off == without).all() and (never == without).all()
    assert (march(problem, mesh)["contact_force"] != without).any()


def test_an_incident_at_the_very_start_happens() -> None:
    problem = undamped((DropperBreak(0.0, DropperPlace(90.0)),))
    mesh = mesh_of(problem.line, 2)
    problem = replace(problem, train=replace(problem.train, end=75.0))
    seen = march(problem, mesh)
    number = int(np.argmin(np.abs(mesh.x(mesh.droppers[:, 1]) - 90.0)))
    force = seen["dropper_force"][:, number]
    assert force[0] > 50.0 and not force[1:].any()
    assert len(seen.time) == 101


def test_times_are_rounded_to_steps() -> None:
    first, second, third = (
        DropperBreak(time, DropperPlace(90.0)) for time in (0.0014, 0.0016, 0.0114)
    )
    assert in_steps([third, second, first], 1e-3) == [
        Happened(1, (first,)),
        Happened(2, (first, second)),
        Happened(11, (first, second, third)),
    ]
    assert in_steps([third, second, first], 4e-3) == [
        Happened(0, (first, second)),
        Happened(3, (first, second, third)),
    ]
    assert in_steps([], 1e-3) == []
