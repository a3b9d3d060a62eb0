"""Columns of A^-1 of long reach end where forces are felt."""

from __future__ import annotations

import numpy as np
import pytest
from axial_lines import ALONG, elastic_line
from measuring import COMM
from small_lines import mesh_of, numerics, problem_of

from catenary.solver.integrators.line_integrator import make_line
from catenary.solver.linear import unit_responses
from catenary.solver.model.partition import distribute
from catenary.solver.problem.problem import Damping
from catenary.solver.statics.form_finding import find_form


@pytest.mark.parametrize(
    ("margin", "within"),
    [(1.1, 1e-13), (0.5, 1e-12)],
    ids=["as it is", "some are felt further"],
)
def test_columns_of_long_reach_end_where_forces_are_felt(
    margin: float, within: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(unit_responses, "_MARGIN", margin)
    # As much damping as the paper's lets a force along the track reach ten times as far.
    problem = problem_of(elastic_line(3), ALONG, damping=Damping(0.0275, 0.0))
    found = find_form(problem, mesh_of(elastic_line(3), 3))[0]
    made = make_line(COMM, found, distribute(found, 1, 0), numerics(1e-3), True)
    nodes = found.mesh.wires["contact_wire"][20:120:9]
    dofs = found.dofs(nodes)[:, None, None]
    x = found.mesh.x(nodes)
    given = unit_responses.Forces(dofs, np.ones(dofs.shape), x, np.zeros(x.size))
    short = made.responses.columns(given)
    monkeypatch.setattr(unit_responses, "_LONG", np.inf)
    whole = made.responses.columns(given)
    assert short.reach <= whole.reach and short.data.size <= whole.data.size
    for place in range(nodes.size):
        columns = []
        for kept in (short, whole):
            column = np.zeros(found.n_dofs)
            begin, at, width = kept.start[place], kept.at[place], kept.width[place]
            column[begin : begin + width] = kept.data[at : at + width]
            columns.append(column)
        assert np.abs(columns[0] - columns[1]).max() < within * np.abs(columns[1]).max()
    made.destroy()
