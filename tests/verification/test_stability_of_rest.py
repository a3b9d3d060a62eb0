"""The sign of a line's stiffness at rest: pushed steady arms against dense eigenvalues.

A bar of length l between two joints that is pushed with S adds -(S / l) (1 - e e^T) to the
stiffness. A rest is refused exactly where the smallest eigenvalue of the dense matrix is negative.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from measuring import free_matrices
from small_lines import WHOLE, ac_simple_line, mesh_of, problem_of

from catenary import InputError
from catenary.solver.effects.build_model import build
from catenary.solver.model.model import Model
from catenary.solver.statics.form_finding import find_form
from catenary.solver.statics.line_at_rest import refuse_unstable

# Of the arms of ac_simple [m], and the forces with which they are pushed [N].
FORCES = (500.0, 2e3, 4e3, 6e3, 8e3, 1.2e4, 2e4)


def pushed(force: float, arm: int) -> Model:
    """A staggered line at rest, one of whose arms is pushed with ``force`` [N]."""
    line = replace(ac_simple_line(4), stagger=(0.2, -0.2, 0.2, -0.2, 0.2))
    problem = problem_of(line, WHOLE | {"lateral_motion"})
    mesh = mesh_of(line, 2)
    model, form = find_form(problem, mesh)
    assert form.lateral is not None
    forces = form.lateral.arm_force.copy()
    forces[arm] *= force / np.linalg.norm(forces[arm])
    pushes = np.zeros(len(forces), dtype=bool)
    pushes[arm] = True
    lateral = replace(form.lateral, arm_force=forces, arm_pushed=pushes)
    return build(problem, mesh, model.dropper_lengths, form=replace(form, lateral=lateral))


def refused(model: Model) -> str:
    try:
        refuse_unstable(model)
    except InputError as error:
        return str(error)
    return ""


@pytest.mark.parametrize("arm", [0, pytest.param(1, marks=pytest.mark.study)])
def test_a_rest_is_refused_where_its_stiffness_has_a_negative_eigenvalue(arm: int) -> None:
    found = []
    for force in FORCES:
        model = pushed(force, arm)
        _, stiffness = free_matrices(model)
        least = float(np.linalg.eigvalsh(stiffness.toarray())[0])
        sentence = refused(model)
        place = float(model.mesh.x(model.mesh.steady_arms[arm]))
        print(f"{force:g} N: least eigenvalue {least:.4g} N/m; {sentence or 'stable'}")
        assert bool(sentence) == (least < 0.0)
        if sentence:
            assert f"steady arm at {place:.4g} m with {force:.0f} N" in sentence
            # Elimination comes to the wire beyond the arm before it fails, within a span.
            said = float(sentence.split("near ")[1].split(" m")[0])
            assert abs(said - place) < 55.0
        found.append(bool(sentence))
    assert not found[0] and found[-1]


def test_a_line_without_pushed_parts_is_not_factored(monkeypatch: pytest.MonkeyPatch) -> None:
    line = ac_simple_line(4)
    model, _ = find_form(problem_of(line), mesh_of(line, 2))

    def fails(model: Model) -> None:
        raise AssertionError("the stiffness was factored")

    monkeypatch.setattr("catenary.solver.statics.line_at_rest._first_unstable", fails)
    refuse_unstable(model)
