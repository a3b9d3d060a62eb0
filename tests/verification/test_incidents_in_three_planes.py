"""Incidents of lines whose matrices depend on their shape: leaning droppers, arms, stretch."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from axial_lines import HANGING_ALONG, with_stiffness
from measuring import check, march, matrix_of
from small_lines import FREE_MASS, WHOLE, ac_simple_line, mesh_of, numerics, problem_of, train
from spatial_line import SpatialLine, shape

from catenary.meshgen.line import DropperPlace
from catenary.meshgen.mesh import CONTACT_WIRE, MESSENGER_WIRE
from catenary.meshgen.topologies.line_data import LineData
from catenary.solver.problem.defects import DropperBreak, LineIncident, TensionLoss
from catenary.solver.problem.ends import AlongTrack
from catenary.solver.problem.problem import Damping
from catenary.solver.statics.after_incidents import changed_line
from catenary.solver.statics.form_finding import find_form

INCIDENTS = {"dropper_break", "tension_loss"}
LATERAL = WHOLE | INCIDENTS | {"lateral_motion"}


def staggered(n: int) -> LineData:
    """Few droppers, which lean, and arms of ten degrees."""
    line = ac_simple_line(n)
    return replace(
        line,
        dropper_positions=((15.0, 40.0),) * n,
        pre_sag=((0.02, 0.02),) * n,
        steady_arm=replace(line.steady_arm, inclination=np.deg2rad(10.0)),
    )


LOST = (TensionLoss(0.1, CONTACT_WIRE, 0.7),)
BOTH = (TensionLoss(0.1, MESSENGER_WIRE, 0.9), DropperBreak(0.1, DropperPlace(40.0)))


@pytest.mark.parametrize("incidents", [LOST, BOTH], ids=["contact wire", "messenger and dropper"])
def test_matrices_are_those_about_the_rest_that_the_line_comes_to(
    incidents: tuple[LineIncident, ...],
) -> None:
    """Least energy, written down in the tests, with its second derivatives; the rest is one of the
    equation of motion: K' d* = g."""
    line = with_stiffness(staggered(2))
    effects = HANGING_ALONG | INCIDENTS | {"lateral_motion"}
    problem = problem_of(line, effects, along=AlongTrack(end=True), incidents=incidents)
    model, form = find_form(problem, mesh_of(line, 1))
    changed = changed_line(model, form, incidents)
    energy = SpatialLine(changed.model, form, form.dropper_length)
    for wire in changed.model.problem.line.wires:
        energy.pulls[int(model.mesh.wires[wire.name][-1])] = wire.tension
    numbers = energy.numbers()
    held = np.isin(numbers, model.constrained)
    expected = energy.rest(shape(form), held)
    wanted = energy.hessian(expected)[np.ix_(~held, ~held)]
    tangent = matrix_of(changed.model, stiffness=1.0).toarray()
    found = tangent[np.ix_(numbers, numbers)][np.ix_(~held, ~held)]
    check("stiffness", found, wanted, within=1e-8 * np.abs(wanted).max())
    moved = (expected - shape(form))[~held]
    assert np.abs(moved).max() > 5e-3
    rest = np.linalg.solve(found, changed.load[numbers][~held])
    check("rest [m]", rest, moved, within=2e-8)
    # The geometric stiffness of the first rest is another one by more than a tenth of the arms'.
    before = matrix_of(model, stiffness=1.0).toarray()
    at = model.dofs(model.mesh.steady_arms, "u")
    other = np.abs(tangent[at, at] - before[at, at])
    print(f"of the arms along the track: {before[at, at]} to {tangent[at, at]} N/m; {other}")


def test_a_march_comes_to_the_rest_that_statics_finds() -> None:
    """Strongly damped, with leaning droppers and arms as bars: to what is left of the motion."""
    line, settled = staggered(3), 4.0
    still = train(20.0, 20.0, 20.0 + 20.0 * settled, data=FREE_MASS, static_force=1.0)
    incidents = (TensionLoss(0.1, CONTACT_WIRE, 0.8), DropperBreak(0.2, DropperPlace(70.0)))
    problem = problem_of(
        line,
        frozenset(LATERAL),
        damping=Damping(5e-3, 6.0),
        train=replace(still, raise_time=1e6, start_below=2.0),
        numerics=numerics(2e-3),
        incidents=incidents,
    )
    mesh = mesh_of(line, 2)
    model, form = find_form(problem, mesh)
    seen = march(problem, mesh, lambda view: (view.step % 500 == 0) and view.checkpoint())
    # By nodes along the track.
    state, every = seen.watched[-1]["displacement"].reshape(mesh.n_nodes, -1), range(mesh.n_nodes)
    moved = np.zeros(model.n_dofs)
    for column, name in enumerate(model.unknowns):
        moved[model.dofs(np.array(every), name)] = state[model.row_of_node, column]
    changed = changed_line(model, form, incidents)
    free = np.setdiff1d(np.arange(model.n_dofs), model.constrained)
    stiffness = matrix_of(changed.model, stiffness=1.0)[free][:, free].toarray()
    expected = np.zeros(model.n_dofs)
    expected[free] = np.linalg.solve(stiffness, changed.load[free])
    largest = np.abs(expected).max()
    assert largest > 0.01
    check("rest [m]", moved, expected, within=1e-4 * largest)
    # Droppers carry what is about to hang on them: all weights, and the broken one nothing.
    force = seen["dropper_force"][-1]
    number = int(np.argmin(np.abs(mesh.x(mesh.droppers[:, 1]) - 70.0)))
    assert force[number] == 0.0 and (np.delete(force, number) > 0.0).all()
