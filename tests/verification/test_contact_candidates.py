"""Several contact wires over one strip: twins, unequal twins, and an overlap that passes the force.

Twins of half a wire each are the one wire; all others are held against dense matrices in which
every set of contacts and slack droppers is tried.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from contact_wires import STIFFNESS, one_wire, overlap, problem_on, twins
from dense_line import DenseLine
from measuring import History, check, march
from small_lines import WHOLE, mesh_of, numerics, train

from catenary.mbs.head.stepping import LateralPath, Stepping
from catenary.mbs.head.strips import Flexure, Strips, Suspension, Turning
from catenary.mbs.lumped import LumpedData, LumpedPantograph
from catenary.meshgen.mesh import LineMesh
from catenary.solver.contact.contact_wire import ContactWires
from catenary.solver.kernels import native
from catenary.solver.model.partition import distribute
from catenary.solver.problem.contact_laws import LinearLaw
from catenary.solver.problem.problem import Damping, Problem
from catenary.solver.statics.form_finding import find_form


@pytest.mark.parametrize("way", ["implicit", "iterated", "fixed_point"])
def test_twins_of_half_a_wire_are_the_wire(way: str) -> None:
    given = {"scheme": way} if way == "fixed_point" else {"coupling": way}
    steps = numerics(1e-3, **given)  # type: ignore[arg-type]
    whole = problem_on(one_wire(), numerics=steps)
    # Springs side by side: half the stiffness each.
    halves = problem_on(twins(0.5), contact=LinearLaw(0.5 * STIFFNESS, 0.0), numerics=steps)
    expected, seen = (march(one, mesh_of(one.line, 2)) for one in (whole, halves))
    assert (expected["dropper_force"] == 0.0).any() and (expected["contact_force"] == 0.0).any()
    largest = expected["contact_force"].max()
    # A fixed point is left at tolerances of displacements and velocities.
    close = (1e-9 if way == "implicit" else 1e-6) * largest
    check("contact force [N]", seen["contact_force"], expected["contact_force"], within=close)
    check("head [m]", seen["head_height"], expected["head_height"], within=1e-9)
    check("wire [m]", seen["wire_height"], expected["wire_height"], within=1e-8)
    pairs = seen["dropper_force"].reshape(len(seen.time), -1, 2).sum(axis=2)
    check("dropper forces [N]", pairs, expected["dropper_force"], within=close)


LEVER = Strips(2, 0.5, 1.6, Suspension(1.0, 8000.0, 10.0), Turning(0.4, 300.0, 0.5))
BENDING = replace(LEVER, flexure=Flexure(600.0, 0.9, 2))


@pytest.mark.parametrize("strips", [Strips(2, 0.5), LEVER, BENDING], ids=["fixed", "lever", "bend"])
def test_two_strips_under_twins_of_half_a_wire_are_two_strips_under_the_wire(
    strips: Strips,
) -> None:
    """Four contacts: fixed strips, strips at both ends of a lever that pitches, strips that bend.

    The twins stand where the one wire does and share the force of each strip alike.
    """
    data = LumpedData((7.2, 15.0), (4200.0, 50.0), (10.0, 90.0), strips)

    def with_strips(line: Any, **given: Any) -> Problem:
        names = WHOLE | {"flexible_strips"}
        made = problem_on(line, **given)
        (place,) = made.train.placements
        place = replace(place, data=data)
        ours = replace(made.train, placements=(place,))
        return replace(made, train=ours, effects=made.effects | (names & {"flexible_strips"}))

    whole = with_strips(one_wire())
    halves = with_strips(twins(0.5), contact=LinearLaw(0.5 * STIFFNESS, 0.0))
    forces = []
    for one in (whole, halves):
        kept: list[np.ndarray] = []
        march(one, mesh_of(one.line, 2), lambda view, kept=kept: kept.append(
            np.concatenate([view.strip_force, view.contact_wire_force])
        ))  # fmt: skip
        forces.append(np.array(kept))
    expected, of_strips, of_wires = forces[0], forces[1][:, :2], forces[1][:, 2:]
    assert (expected == 0.0).any() and (expected > 0.0).any(axis=0).all()
    largest = expected.max()
    check("force of each strip [N]", of_strips, expected, within=1e-8 * largest)
    total = of_strips.sum(axis=1)
    check("sum of wires [N]", of_wires.sum(axis=1), total, within=1e-9 * largest)


def in_dense(problem: Problem, mesh: LineMesh, seen: History) -> tuple[DenseLine, np.ndarray]:
    """Contact forces of each wire, by dense matrices at the places of a march."""
    _, form = find_form(problem, mesh)
    dense = DenseLine(problem, mesh, form, False)
    dense.state = np.zeros((3, dense.size))
    dense.state[:, -2:] = seen.watched[0]["pantograph_0"].reshape(3, 2)
    forces = []
    for x in seen["contact_position"][1:, 0]:
        dense.step(x)
        forces.append(dense.contact_forces)
    return dense, np.array(forces)


def checkpoint(view: Any) -> Any:
    return view.checkpoint()


@pytest.mark.parametrize("name", ["unequal twins", "overlap"])
def test_a_march_is_that_of_dense_matrices_with_every_set_tried(name: str) -> None:
    line = twins(0.3) if name == "unequal twins" else overlap()
    problem, mesh = problem_on(line), mesh_of(line, 2)
    shares = []

    def watch(view: Any) -> Any:
        shares.append(view.contact_wire_force.copy())
        return view.checkpoint() if view.step == 0 else None

    seen = march(problem, mesh, watch)
    _, forces = in_dense(problem, mesh, seen)
    touching = forces > 0.0
    both, single = touching.all(axis=1), touching.sum(axis=1) == 1
    print(f"{name}: both touch in {both.sum()} of {len(both)} steps, one in {single.sum()}")
    assert both.sum() > 20 and touching.any(axis=0).all() and single.sum() > 5
    check("contact force [N]", seen["contact_force"][1:, 0], forces.sum(axis=1), within=1e-8)
    check("force on each wire [N]", np.array(shares)[1:], forces, within=1e-8)


@pytest.mark.study
def test_an_overlap_passes_the_force_without_a_jump_and_keeps_the_energy() -> None:
    """Without damping the line gains the work of the contact forces, and no more.

    Average acceleration keeps that balance to round-off where droppers may push. Of a continuous
    force the largest change in a step halves with the step.
    """
    line = overlap()
    mesh = mesh_of(line, 3)
    changes, steps = [], (2e-3, 1e-3, 5e-4)
    for dt in steps:
        # A head that hardly swings: the line has no damping, contact is to last all the same.
        calm = LumpedData((2.0, 15.0), (4200.0, 50.0), (800.0, 500.0))
        run = train(20.0, 6.0, 42.0, data=calm, static_force=120.0, raise_time=0.3)
        run = replace(run, placements=(replace(run.placements[0], nominal_height=5.5),))
        effects = WHOLE - {"dropper_slackening", "transition_spans"}
        problem = problem_on(
            line, damping=Damping(0.0, 0.0), train=run, numerics=numerics(dt), effects=effects
        )
        states: list[Any] = []

        def watch(view: Any, states: list[Any] = states) -> None:
            states.append((view.strip_force.copy(), sum(view.energies()), view.checkpoint()))

        # States of the last, finest march alone are compared.
        seen = march(problem, mesh, watch if dt == steps[-1] else None)
        force, x = seen["contact_force"][:, 0], seen["contact_position"][:, 0]
        passing = (x > 17.0) & (x < 31.0)
        print(f"contact in {100 * (force[passing] > 0.0).mean():.1f} % of the overlap")
        assert (force[passing] > 0.0).mean() > 0.9
        changes.append(np.abs(np.diff(force[passing])).max())
    print(f"largest change of the force in a step: {changes} N")
    assert changes[1] < 0.65 * changes[0] and changes[2] < 0.65 * changes[1]
    model, form = find_form(problem, mesh)
    dense = DenseLine(problem, mesh, form, False)
    names = model.unknowns
    work, energy = [0.0], np.array([one[1] for one in states])
    # What each wire carries follows from its depth.
    law, before = STIFFNESS, None
    for (_, _, state), place, height in zip(states, x, seen["head_height"][:, 0], strict=True):
        own = np.zeros(dense.size)
        by_row = state["displacement"].reshape(-1, len(names))[model.row_of_node]
        own[: by_row.size] = by_row.ravel()
        own[-2] = height
        load = np.zeros(dense.size)
        for number in (0, 1):
            direction, rest = dense.meets(place, number)
            load -= law * max(0.0, direction @ own + rest) * direction
        load[-2:] = 0.0
        if before is not None:
            work.append(work[-1] + float(0.5 * (load + before[1]) @ (own - before[0])))
        before = own, load
    largest = energy.max()
    check("energy [J]", energy - energy[0], work, within=1e-7 * largest)
    assert largest > 0.1


def test_a_wire_beside_the_strip_is_not_touched() -> None:
    line = twins(0.3)
    mesh = mesh_of(line, 2)
    aside = mesh.points.copy()
    aside[mesh.wires["contact_wire_2"], 1] = 0.9
    mesh = replace(mesh, points=aside)
    problem = problem_on(line)
    model, form = find_form(problem, mesh)
    wires = ContactWires(model, form, distribute(model, 1, 0))
    touches = wires.on_wires(np.array([0, 1, 1]), np.array([0.8, 0.8, 1.0]))
    native.locate(np.full(3, 17.0), wires.shapes, touches)
    assert touches["present"].tolist() == [1.0, 0.0, 1.0]
    assert not touches["value"][1].any() and not touches["whole_slope"][1].any()
    place = problem.train.placements[0]
    narrow = replace(place, data=replace(place.data, strips=Strips(length=1.6)))  # type: ignore[type-var]
    narrow_run = replace(problem, train=replace(problem.train, placements=(narrow,)))
    seen = march(narrow_run, mesh, checkpoint)
    dense = DenseLine(narrow_run, mesh, form, False)
    # Only the first wire is met: the second one is out of reach for the dense model, too.
    meets = dense.meets
    dense.meets = lambda x, contact=0: meets(x) if contact == 0 else (0.0 * meets(x)[0], -1.0)  # type: ignore[method-assign]
    dense.state = np.zeros((3, dense.size))
    dense.state[:, -2:] = seen.watched[0]["pantograph_0"].reshape(3, 2)
    forces = [dense.step(x)[0] for x in seen["contact_position"][1:, 0]]
    check("contact force [N]", seen["contact_force"][1:, 0], forces, within=1e-8)


@pytest.mark.parametrize("rolls", [False, True])
def test_a_head_under_two_wires_is_that_head_at_two_places(rolls: bool) -> None:
    """Heights and compliances of contacts follow from those of a strip by the lateral positions."""
    roll = Turning(2.0, 600.0, 4.0)
    data = LumpedData((7.2, 15.0), (4200.0, 50.0), (10.0, 90.0), Strips(2, 0.5), roll)
    places = (0.3, -0.2)

    def path(*places: float) -> LateralPath:
        courses = [((0.0, 100.0), (y, y)) for y in places]
        return LateralPath(courses, 10.0, data.strips.offsets, 20.0)

    def head(lateral: Any, wires: int) -> LumpedPantograph:
        own = replace(data, strips=replace(data.strips, wires=wires))
        made = LumpedPantograph(
            own, 100.0, 5.0, Stepping(0.0, 1e-3, lateral=lateral if rolls else None)
        )
        made.place(5.0)
        return made

    both = head(path(*places), 2)
    alone = [head(path(y), 1) for y in places]
    for time in (1e-3, 2e-3):
        state = both.predict(time)
        singles = [one.predict(time) for one in alone]
        for k, single in enumerate(singles):
            assert state.height[k::2] == pytest.approx(single.height, abs=1e-14)
            own = state.height_compliance[k::2, k::2]
            assert own == pytest.approx(single.height_compliance, rel=1e-12)
        between = state.height_compliance[0::2, 1::2]
        assert between == pytest.approx(state.height_compliance[1::2, 0::2].T, rel=1e-12)
        # On a head that does not roll it is all the same where a force acts.
        same = np.array_equal(between, state.height_compliance[0::2, 0::2])
        assert same != rolls
        force = np.array([30.0, 0.0, 20.0, 0.0])
        both.advance(force)
        alone[0].advance(force[0::2])
        # The other one is pushed where the wire is that it does not meet: take its state over.
        alone[1].restore(both.state())
        alone[0].restore(both.state())
