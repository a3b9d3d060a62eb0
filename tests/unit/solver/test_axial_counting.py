"""What motion along the track and its tensioners add to a model, and that nothing else has it."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
from axial_lines import AXIAL, elastic_line
from small_lines import HANGING, mesh_of, problem_of

from catenary.meshgen.mesh import LineMesh
from catenary.solver.effects.build_model import build
from catenary.solver.model.model import Model
from catenary.solver.problem.ends import AlongTrack, Tensioner

ENDS = AlongTrack(Tensioner(travel=0.5), end=True)


@pytest.fixture(scope="module")
def mesh() -> LineMesh:
    return mesh_of(elastic_line(2), 1)


def model_with(names: frozenset[str], mesh: LineMesh, along: AlongTrack = ENDS) -> Model:
    lengths = np.full(mesh.droppers.shape[0], 1.0)
    return build(problem_of(elastic_line(2), HANGING | names, along=along), mesh, lengths)


def contents(model: Model) -> Counter[tuple[str, int, int]]:
    return Counter((b.component, *b.dofs.shape) for b in model.blocks)


def test_without_the_effect_there_is_no_trace_of_it(mesh: LineMesh) -> None:
    """Nor of tensioners, which a scene may name all the same."""
    bare = model_with(frozenset(), mesh, AlongTrack())
    for names in (frozenset(), frozenset({"tensioners"})):
        model = model_with(names, mesh)
        assert model.unknowns == ("w", "theta_y") and model.n_dofs == bare.n_dofs
        assert model.terms_of == bare.terms_of
        for ours, theirs in zip(model.blocks, bare.blocks, strict=True):
            assert np.array_equal(ours.dofs, theirs.dofs)
            for matrices in ("mass", "stiffness"):
                assert np.array_equal(getattr(ours, matrices), getattr(theirs, matrices))


def test_motion_along_the_track_adds_bars_and_pendulums(mesh: LineMesh) -> None:
    bare = model_with(frozenset(), mesh)
    model = model_with(frozenset({"axial_motion"}), mesh)
    n, n_droppers = mesh.n_nodes // 2, len(mesh.droppers)
    assert model.unknowns == ("w", "theta_y", "u") and model.n_dofs == 3 * mesh.n_nodes
    assert contents(model) - contents(bare) == {
        ("contact_wire", n - 1, 6): 1,
        ("messenger_wire", n - 1, 6): 1,
        ("droppers", n_droppers, 4): 1,
    }
    assert model.terms_of["axial_motion"] == 2 * (n - 1) + n_droppers
    assert model.constrained.size == 2 * bare.constrained.size
    assert not model.weight[model.dofs(np.arange(mesh.n_nodes), "u")].any()


def test_tensioners_add_weights_and_stops_where_they_turn(mesh: LineMesh) -> None:
    alone = model_with(frozenset({"axial_motion"}), mesh)
    both = model_with(AXIAL, mesh)
    assert contents(both) - contents(alone) == {
        ("tensioners", 2, 1): 1,
        ("tensioner_stops_down", 2, 1): 1,
        ("tensioner_stops_up", 2, 1): 1,
    }
    assert both.terms_of["tensioners"] == 6 + 1
    assert both.constrained.size == alone.constrained.size - 2
    free = model_with(AXIAL, mesh, AlongTrack(end=True))
    assert contents(free) - contents(alone) == {("tensioners", 2, 1): 1}
    rubbing = model_with(AXIAL, mesh, AlongTrack(Tensioner(efficiency=0.97), end=True))
    assert contents(rubbing) - contents(alone) == {
        ("tensioners", 2, 1): 2,
        ("tensioner_slips_in", 2, 1): 1,
        ("tensioner_slips_out", 2, 1): 1,
    }


def test_mid_points_hold_wires_between_their_ends(mesh: LineMesh) -> None:
    ends = AlongTrack(start=True, end=True, mid_points=(60.0,))
    model = model_with(AXIAL, mesh, ends)
    along = model.dofs(np.arange(mesh.n_nodes), "u")
    held = np.isin(along, model.constrained)
    assert sorted(mesh.x(np.flatnonzero(held)).tolist()) == [60.0, 60.0]
