"""Static lift of the contact wire under a unit force: closed form and a dense solve."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from measuring import check, free_dofs, free_matrices
from small_lines import (
    BARE,
    EN_CONTACT_WIRE,
    HANGING,
    ac_simple_line,
    bare_wires,
    make_line,
    mesh_of,
    problem_of,
)

from catenary.meshgen.build import make_mesh
from catenary.meshgen.mesh import CONTACT_WIRE
from catenary.solver.effects.build_model import build
from catenary.solver.statics import elasticity as lifts
from catenary.solver.statics.elasticity import elasticity
from catenary.solver.statics.form_finding import find_form


def test_lift_of_a_single_wire_is_that_of_a_tensioned_beam() -> None:
    """Unit force at a, b = L - a from the other end, lambda = sqrt(T / EI):

    w = a b / (T L) - sinh(lambda a) sinh(lambda b) / (T lambda sinh(lambda L)),

    the triangle of a string, rounded over 1 / lambda.
    """
    length, rounding, n_elements = 20.0, 0.5, 160
    tension = EN_CONTACT_WIRE.tension
    wire = replace(EN_CONTACT_WIRE, bending_stiffness=tension * rounding**2)
    line = bare_wires(length, contact_wire=wire)
    model = build(problem_of(line, BARE), mesh_of(line, n_elements), np.zeros(0))
    found = elasticity(model, 0.0, length)
    a, b = found.x, length - found.x
    layer = np.sinh(a / rounding) * np.sinh(b / rounding) / np.sinh(length / rounding)
    expected = a * b / (tension * length) - rounding * layer / tension
    # The force stands on a node, so that elements see a smooth boundary layer, lambda / (2 T) in
    # its fourth derivative times lambda^2; the nodes are off by (lambda h)^2 of its interpolation.
    h = length / n_elements
    within = h**4 / (384 * 2 * tension * rounding**3)
    check("lift [m/N]", found.lift, expected, within=within)
    assert found.x[0] == 0.0 and found.lift[0] == found.lift[-1] == 0.0, "held ends give way"


def test_graded_elements_carry_the_bend_at_droppers() -> None:
    """A wire bends within sqrt(EI / T) = 0.09 m of a point load, an eighth of eight even elements
    a gap. Elements that are shortest there give the lift at droppers as finer ones do."""
    line = make_line(ac_simple_line(3))
    places = np.array(line.droppers[0].lower_x)
    places = places[(places > 55.0) & (places < 110.0)]

    def lift(elements: int, grading: float) -> np.ndarray:
        mesh = make_mesh(line, elements, grading=grading)
        model, _ = find_form(problem_of(line, HANGING), mesh)
        found = elasticity(model, 55.0, 110.0)
        return found.lift[np.searchsorted(found.x, places - 1e-6)]

    fine = lift(96, 1.0)
    even, graded = (np.abs(lift(8, grading) - fine).max() for grading in (1.0, 6.0))
    # First elements are 0.41 times as long, and errors fall at least like h where h > sqrt(EI / T).
    print(f"lift at droppers off by {1e9 * even:.1f} and, graded, {1e9 * graded:.1f} nm/N")
    assert graded < 0.41 * even


def test_lift_of_a_span_agrees_with_a_dense_solve() -> None:
    line = ac_simple_line(3)
    model, _ = find_form(problem_of(line, HANGING), mesh_of(line, 4))
    found = elasticity(model, 55.0, 110.0)
    _, stiffness = free_matrices(model)
    compliance = np.linalg.inv(stiffness.toarray())
    nodes = model.mesh.wires[CONTACT_WIRE]
    inside = (model.contact_x > 55.0 - 1e-6) & (model.contact_x < 110.0 + 1e-6)
    rows = np.searchsorted(free_dofs(model), model.dofs(nodes[inside]))
    check("positions [m]", found.x, model.contact_x[inside], within=1e-12)
    # Two solves of the same equations: round-off times the condition number.
    condition = np.linalg.cond(stiffness.toarray())
    expected = np.diag(compliance)[rows]
    check("lift [m/N]", found.lift, expected, within=np.finfo(float).eps * condition * expected)
    print(f"condition number {condition:.1e}, lift {1e3 * found.lift.max():.3f} mm/N at most")
    # A span is stiffest near its masts and softest in its middle.
    assert 70.0 < found.x[np.argmax(found.lift)] < 95.0


def test_a_long_line_is_looked_at_as_far_as_it_moves(monkeypatch: pytest.MonkeyPatch) -> None:
    """A first look at 30 m to both sides ends where the line still moves, and is widened."""
    line = ac_simple_line(30)
    model, _ = find_form(problem_of(line, HANGING), mesh_of(line, 2))
    stretch = 14 * 55.0, 15 * 55.0
    whole = elasticity(model, *stretch).lift
    monkeypatch.setattr(lifts, "_FIRST_REACH", 30.0)
    looked: list[int] = []
    condensed = lifts._condensed

    def counted(bands, first, last):
        looked.append(bands.shape[1])
        return condensed(bands, first, last)

    monkeypatch.setattr(lifts, "_condensed", counted)
    found = elasticity(model, *stretch).lift
    assert len(looked) > 1 and looked[0] < looked[-1] <= model.n_dofs
    check("lift [m/N]", found, whole, within=1e-12 * whole.max())


def test_a_long_stretch_is_solved_in_parts_with_each_place_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    line = ac_simple_line(12)
    model, _ = find_form(problem_of(line, HANGING), mesh_of(line, 2))
    monkeypatch.setattr(lifts, "_LONGEST", 1e9)
    whole = elasticity(model, 55.0, 605.0)
    monkeypatch.setattr(lifts, "_LONGEST", 55.0)  # cuts at masts, where nodes are
    found = elasticity(model, 55.0, 605.0)
    np.testing.assert_array_equal(found.x, whole.x)
    check("lift [m/N]", found.lift, whole.lift, within=1e-12 * whole.lift.max())
