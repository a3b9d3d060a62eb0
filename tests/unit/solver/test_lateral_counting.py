"""What the lateral plane adds to a model, counted."""

from __future__ import annotations

import pytest
from counted_effects import (
    contents,
    counts,
    full_line,
    full_problem,
)
from small_lines import BARE, mesh_of

from catenary.meshgen.mesh import LineMesh
from catenary.solver.statics.form_finding.equilibrium import find_form


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
