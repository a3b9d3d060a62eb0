"""Lines of three wires under load, in motion and after incidents, against dense matrices."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from dense_line import DenseLine
from measuring import check, march, matrix_of, solve_free
from more_wires import (
    AUXILIARY,
    STITCH,
    TOPOLOGIES,
    data_of,
)
from scipy import sparse
from scipy.sparse import linalg as sparse_linalg
from small_lines import WHOLE, mesh_of, numerics, problem_of, train
from static_line import absolute_rest, first_rest

from catenary.meshgen.line import DropperPlace, Line
from catenary.meshgen.mesh import CONTACT_WIRE
from catenary.meshgen.topologies.all_topologies import make_line
from catenary.solver.problem.defects import DropperBreak, TensionLoss
from catenary.solver.problem.problem import Damping, Problem
from catenary.solver.statics.after_incidents import changed_line
from catenary.solver.statics.elasticity import elasticity
from catenary.solver.statics.form_finding import find_form


def small(topology: str) -> Line:
    """Two short spans: few enough droppers for all sets of slack ones."""
    data = data_of(topology, 2)
    places = (3.0, 9.0, 15.0, 21.0) if topology == "compound" else (4.0, 12.0, 20.0)
    spans = {"span_lengths": (24.0,) * 2, "dropper_positions": (places,) * 2}
    assert data.auxiliary_wire is not None
    auxiliary = replace(data.auxiliary_wire, dropper_positions=((6.0, 18.0),) * 2)
    short = replace(data, **spans, auxiliary_wire=auxiliary)  # type: ignore[arg-type]
    line = make_line(replace(short, pre_sag=((0.0,) * len(places),) * 2))
    return replace(line, clamps=tuple(replace(group, mass=0.0) for group in line.clamps))


def problem_on(line: Line) -> Problem:
    """A head that rises into the wire, strong enough to leave droppers slack."""
    run = train(100.0, 6.0, 19.0, static_force=1000.0, raise_time=0.0, nominal_height=5.5)
    return problem_of(
        line, WHOLE, damping=Damping(5e-3, 0.0), train=replace(run, start_below=0.02),
        numerics=numerics(1e-3), slack_dampers_act=True,
    )  # fmt: skip


@pytest.mark.parametrize("topology", list(TOPOLOGIES))
def test_elasticity_is_that_of_dense_matrices(topology: str) -> None:
    line = small(topology)
    mesh = mesh_of(line, 2)
    problem = problem_on(line)
    model, form = find_form(problem, mesh)
    dense = DenseLine(problem, mesh, form, True)
    stiffness = sparse.csc_matrix(dense.matrices[2][: 2 * mesh.n_nodes, : 2 * mesh.n_nodes])
    free = dense.free[dense.free < 2 * mesh.n_nodes]
    factor = sparse_linalg.splu(stiffness[free][:, free].tocsc())
    found = elasticity(model, 6.0, 42.0)
    nodes = mesh.wires[CONTACT_WIRE]
    inside = nodes[(mesh.x(nodes) > 6.0 - 1e-9) & (mesh.x(nodes) < 42.0 + 1e-9)]
    lift = []
    for node in inside:
        unit = (free == 2 * node).astype(float)
        lift.append(float(factor.solve(unit) @ unit))
    check("lift [m/N]", found.lift, lift, within=1e-9 * max(lift))


@pytest.mark.parametrize("topology", list(TOPOLOGIES))
def test_a_march_is_that_of_dense_matrices(topology: str) -> None:
    line = small(topology)
    mesh = mesh_of(line, 1)
    problem = problem_on(line)
    _, form = find_form(problem, mesh)
    seen = march(problem, mesh, lambda view: view.checkpoint() if view.step == 0 else None)
    dense = DenseLine(problem, mesh, form, True)
    dense.state = np.zeros((3, dense.size))
    dense.state[:, -2:] = seen.watched[0]["pantograph_0"].reshape(3, 2)
    slack, forces, droppers = set(), [], []
    for x in seen["contact_position"][1:, 0]:
        force, carried = dense.step(x)
        slack |= dense.acting - {-1}
        forces.append(force)
        droppers.append(carried)
    lost = sum(force == 0.0 for force in forces)
    print(f"slack were {sorted(slack)}, contact lost in {lost} steps")
    assert len(slack) > 1 and lost > 10
    for name, own, expected in (
        ("contact force [N]", seen["contact_force"][1:, 0], forces),
        ("dropper forces [N]", seen["dropper_force"][1:], droppers),
    ):
        check(name, own, expected, within=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize(
    ("topology", "wire"),
    [("compound", AUXILIARY), ("compound", CONTACT_WIRE), ("stitched", STITCH)],
)
def test_a_wire_that_loses_tension_and_a_dropper_that_breaks_lead_to_a_new_rest(
    topology: str, wire: str
) -> None:
    """K' d = g with the balance lost g, against heights of the line found anew."""
    line = small(topology)
    mesh = mesh_of(line, 2)
    model, form = find_form(problem_on(line), mesh)
    places = mesh.x(mesh.droppers[:, 1])
    number = int(np.flatnonzero(mesh.dropper_group == 1)[0])
    happened = (TensionLoss(0.1, wire, 0.9), DropperBreak(0.2, DropperPlace(float(places[number]))))
    after = changed_line(model, form, happened)
    moved = solve_free(matrix_of(after.model, stiffness=1.0), after.model, after.load)
    tensions = {own.name: own.tension for own in line.wires}
    tensions[wire] *= 0.9
    rest = absolute_rest(model, form, tensions=tensions, broken={number})
    expected = rest - first_rest(model, form)
    assert np.abs(expected).max() > 1e-4
    check("moved [m]", moved, expected, within=1e-9)
