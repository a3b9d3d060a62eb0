"""What the lateral plane adds to a model, counted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from counted_effects import (
    contents,
    counts,
    full_line,
    full_problem,
)
from small_lines import BARE, mesh_of

from catenary.meshgen.mesh import LineMesh
from catenary.solver.model.matrices import whole_matrix
from catenary.solver.problem.problem import Damping
from catenary.solver.statics.form_finding import find_form


@pytest.fixture(scope="module")
def mesh() -> LineMesh:
    return mesh_of(full_line(), 2)


def test_lateral_motion_adds_a_plane_that_no_other_scene_has(mesh: LineMesh) -> None:
    """Unknowns of all nodes, wires, pendulums, bars, masses; of a scene without it no trace."""
    hanging = frozenset({"gravity", "dropper_mass", "clamp_mass", "arm_inertia", "arm_stiffness"})
    names, n = BARE | hanging, counts(mesh)
    without, _ = find_form(full_problem(names), mesh)
    model, form = find_form(full_problem(names | {"lateral_motion"}), mesh)
    assert without.unknowns == ("w", "theta_y") and without.simulated.lateral is False
    assert model.unknowns == ("w", "theta_y", "v", "theta_z") and model.form is form
    assert model.n_dofs == 2 * without.n_dofs
    half = n["elements"] // 2
    assert contents(model) - contents(without) == {
        ("messenger_wire", half, True, True): 1,
        ("contact_wire", half, True, True): 1,
        # Geometric stiffness of droppers and of bars, and the bars themselves.
        ("droppers", n["droppers"], False, True): 1,
        ("steady_arms", n["arms"], False, True): 1,
        # Masses that move sideways.
        ("droppers", n["droppers"], True, False): 2,
        ("messenger_wire", n["droppers"], True, False): 1,
        ("contact_wire", n["droppers"], True, False): 1,
        ("steady_arms", n["arms"], True, False): 1,
    }
    # An arm that is a bar has no further stiffness.
    assert "arm_stiffness" in without.terms_of and "arm_stiffness" not in model.terms_of
    held = 2 * n["supports"] - n["supports"] + mesh.anchors.size
    assert model.constrained.size == without.constrained.size + held


def test_wires_have_a_damping_of_their_own_across_the_track(mesh: LineMesh) -> None:
    """alpha K + beta M of wires in the lateral plane with its pair, all else with the line's."""
    names = BARE | {"gravity", "lateral_motion", "structural_damping"}
    usual = Damping(alpha=1e-3, beta=0.1)
    across = replace(usual, lateral=(2e-3, 0.7))
    found = [
        find_form(replace(full_problem(frozenset(names)), damping=damping), mesh)[0]
        for damping in (usual, across)
    ]
    assert found[0].damping_is_proportional and not found[1].damping_is_proportional
    more = whole_matrix(found[1], damping=1.0) - whole_matrix(found[0], damping=1.0)
    # The wires alone: the same model without what else has a stiffness or a mass in that plane.
    model = found[1]
    alone = replace(model, blocks=[block for block in model.blocks if block.lateral])
    assert len(alone.blocks) == len(model.mesh.wires)
    expected = whole_matrix(alone, mass=0.6, stiffness=1e-3)
    # Round-off of the difference of two sums, in which bars are the largest.
    largest = np.abs(whole_matrix(model, damping=1.0)).max()
    assert np.abs(more - expected).max() < 8 * np.finfo(float).eps * largest
    sideways = np.zeros(model.n_dofs, dtype=bool)
    every = np.arange(mesh.n_nodes)
    for unknown in ("v", "theta_z"):
        sideways[model.dofs(every, unknown)] = True
    assert np.abs(more[~sideways]).max() == 0.0
