"""How a line is cut for the ranks: contiguous, in equal work, never through station or dropper."""

from __future__ import annotations

import numpy as np
import pytest
from small_lines import BARE, ac_simple_line, mesh_of, problem_of

from catenary.solver.effects.build_model import build
from catenary.solver.model.model import Model
from catenary.solver.model.partition import PANTOGRAPH_NODES, distribute


@pytest.fixture(scope="module")
def model() -> Model:
    line = ac_simple_line(5)
    mesh = mesh_of(line, 3)
    return build(problem_of(line, BARE), mesh, np.ones(mesh.droppers.shape[0]))


@pytest.mark.parametrize("n_ranks", [1, 2, 3, 7, 50])
def test_every_unknown_has_one_owner_and_shares_are_even(model: Model, n_ranks: int) -> None:
    parts = [distribute(model, n_ranks, rank) for rank in range(n_ranks)]
    bounds = parts[0].bounds
    assert bounds[0] == 0 and bounds[-1] == model.n_dofs
    assert (np.diff(bounds) >= 0).all()
    owners = sum(part.owned(np.arange(model.n_dofs)).astype(int) for part in parts)
    assert (owners == 1).all()
    # A cut falls on the nearest of the stations: two nodes, four unknowns, off at most.
    ideal = model.n_dofs / n_ranks
    assert np.abs(np.diff(bounds) - ideal).max() <= 8
    assert sum(part.n_local for part in parts) == model.n_dofs


def test_rank_0_of_a_long_line_has_less_by_what_pantographs_take() -> None:
    line = ac_simple_line(90)
    mesh = mesh_of(line, 9)
    long = build(problem_of(line, BARE), mesh, np.ones(mesh.droppers.shape[0]))
    bounds = distribute(long, 3, 0).bounds
    spared = PANTOGRAPH_NODES * len(long.unknowns)
    assert np.abs(np.diff(bounds) + [spared, 0, 0] - (long.n_dofs + spared) / 3).max() <= 8


def test_stations_and_droppers_stay_together(model: Model) -> None:
    mesh = model.mesh
    for n_ranks in (2, 3, 7, 50):
        parts = [distribute(model, n_ranks, rank) for rank in range(n_ranks)]
        owner = np.empty(model.n_dofs, dtype=int)
        for part in parts:
            owner[part.first : part.last] = part.rank
        of_node = owner[model.dofs(np.arange(mesh.n_nodes))]
        assert (of_node == owner[model.dofs(np.arange(mesh.n_nodes), "theta_y")]).all()
        assert (of_node[mesh.droppers[:, 0]] == of_node[mesh.droppers[:, 1]]).all()
        # The wires have their nodes at the same places here.
        wires = list(mesh.wires.values())
        assert (of_node[wires[0]] == of_node[wires[1]]).all()
        assert (np.diff(of_node[wires[0]]) >= 0).all()


def test_more_ranks_than_stations_leave_some_with_nothing(model: Model) -> None:
    n_stations = model.mesh.n_nodes // 2
    n_ranks = n_stations + 10
    parts = [distribute(model, n_ranks, rank) for rank in range(n_ranks)]
    assert any(part.n_local == 0 for part in parts)
    assert sum(part.n_local for part in parts) == model.n_dofs
    assert max(part.n_local for part in parts) <= 8
