"""Elasticity and height under a static force where a line has several contact wires."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from contact_wires import one_wire, overlap, problem_on, twins
from measuring import check, free_dofs, free_matrices
from small_lines import ac_simple_line, mesh_of, train

from catenary.meshgen.line import Line
from catenary.meshgen.topologies.all_topologies import make_line
from catenary.meshgen.topologies.line_data import Overlaps
from catenary.solver.contact.contact_wire import ContactWires
from catenary.solver.contact.pantographs import nominal_height_rule
from catenary.solver.model.model import Model
from catenary.solver.model.partition import distribute
from catenary.solver.model.rest_shape import Equilibrium
from catenary.solver.statics.elasticity import Elasticity, elasticity, middle_span
from catenary.solver.statics.form_finding import find_form


def at_rest(line: Line) -> tuple[Model, Equilibrium]:
    return find_form(problem_on(line), mesh_of(line, 2))


def test_twins_of_half_a_wire_have_its_elasticity() -> None:
    """Pressed together they are the wire; one of them alone gives way more."""
    whole, halves = (elasticity(at_rest(line)[0], 0.0, 24.0) for line in (one_wire(), twins(0.5)))
    check("places [m]", halves.x, whole.x, within=1e-9)
    check("lift [m/N]", halves.lift, whole.lift, within=1e-9 * whole.lift.max())
    check("of both [m/N]", halves.of_wires[:, 0], halves.of_wires[:, 1], within=1e-12)
    inside = (whole.x > 0.1) & (whole.x < 23.9)
    assert (halves.of_wires[inside, 0] > 1.02 * whole.lift[inside]).all()


@pytest.mark.parametrize("name", ["unequal twins", "overlap"])
def test_compliance_is_that_of_dense_matrices(name: str) -> None:
    """The inverse of the whole stiffness at nodes of the wires; NaN where a wire is not."""
    line = twins(0.3) if name == "unequal twins" else overlap()
    model, _ = at_rest(line)
    found = elasticity(model, 0.0, 48.0)
    _, stiffness = free_matrices(model)
    dense = np.zeros((model.n_dofs, model.n_dofs))
    free = free_dofs(model)
    dense[np.ix_(free, free)] = np.linalg.inv(stiffness.toarray())
    wires = [model.mesh.wires[wire] for wire in list(model.mesh.wires)[:2]]
    n_pairs = 0
    largest = np.nanmax(found.compliance)
    for i, x in enumerate(found.x):
        at = [nodes[np.abs(model.mesh.x(nodes) - x) < 1e-6] for nodes in wires]
        for k, nodes in enumerate(wires):
            ends = model.mesh.x(nodes)[[0, -1]]
            there = ends[0] - 1e-6 < x < ends[1] + 1e-6
            assert np.isfinite(found.compliance[i, k, k]) == there
        if all(own.size for own in at):
            dofs = model.dofs(np.concatenate(at))
            n_pairs += 1
            difference = found.compliance[i] - dense[np.ix_(dofs, dofs)]
            assert np.abs(difference).max() < 1e-9 * largest
    print(f"{name}: both wires have a node at {n_pairs} of {found.x.size} places")
    assert n_pairs > 5


def head_on_two(h: np.ndarray, c: np.ndarray, force: float) -> float:
    """Height of a head under two wires in closed form: equal heights share the force, unless one
    would have to pull."""
    first = (h[1] - h[0] + force * (c[1, 1] - c[0, 1])) / (c[0, 0] + c[1, 1] - 2.0 * c[0, 1])
    first = min(max(first, 0.0), force)
    one, other = h[0] + c[0, 0] * first + c[0, 1] * (force - first), force - first
    return float(one if first > 0.0 else h[1] + c[1, 1] * other)


def test_a_head_divides_its_force_among_wires_none_of_which_pulls() -> None:
    rng = np.random.default_rng(7)
    h = rng.uniform(0.0, 0.02, (200, 2))
    roots = rng.normal(size=(200, 2, 2))
    c = 1e-5 * (roots @ roots.transpose(0, 2, 1) + 5.0 * np.eye(2))
    found = Elasticity(np.arange(200.0), c).pressed(h, 120.0)
    expected = [head_on_two(*row, 120.0) for row in zip(h, c, strict=True)]
    check("height [m]", found, expected, within=1e-12)
    alone = c.copy()
    alone[:, 1, :], alone[:, :, 1] = np.nan, np.nan
    away = np.column_stack([h[:, 0], np.full(200, np.nan)])
    check(
        "under one wire [m]",
        Elasticity(np.arange(200.0), alone).pressed(away, 120.0),
        h[:, 0] + 120.0 * c[:, 0, 0],
        within=1e-15,
    )


def test_a_wire_far_above_is_not_touched_and_held_wires_stop_the_head() -> None:
    c = np.array([[[1e-4, 2e-5], [2e-5, 1e-4]], [[0.0, 0.0], [0.0, 0.0]]])
    h = np.array([[5.0, 5.5], [5.0, 5.1]])
    found = Elasticity(np.array([0.0, 1.0]), c).pressed(h, 100.0)
    assert found == pytest.approx([5.01, 5.0], abs=1e-12)


def test_the_nominal_height_of_twins_is_that_of_the_wire() -> None:
    """A head of no given height starts at rest under twins as under the wire that they are."""
    run = train(100.0, 6.0, 42.0, static_force=200.0)
    assert run.placements[0].nominal_height is None
    heights = []
    for line in (one_wire(), twins(0.5)):
        model, form = find_form(problem_on(line, train=run), mesh_of(line, 2))
        wires = ContactWires(model, form, distribute(model, 1, 0))
        rule = nominal_height_rule(
            model.problem, model.simulated, wires, elasticity(model, *middle_span(line))
        )
        heights.append(rule(run.placements[0]))
    check("nominal height [m]", heights[1], heights[0], within=1e-9)


def test_the_middle_span_is_outside_overlaps() -> None:
    """An overlap over the middle leaves the nearest span that only one contact wire reaches."""
    data = ac_simple_line(15)
    for first, n_spans, span in (((5,), 4, 10), ((5,), 5, 3), ((1, 10), 4, 7), ((6,), 3, 4)):
        line = make_line(replace(data, overlaps=Overlaps(first, n_spans, 0.6, 0.4)))
        masts = line.support_positions
        assert middle_span(line) == (masts[span], masts[span + 1]), (first, n_spans)
