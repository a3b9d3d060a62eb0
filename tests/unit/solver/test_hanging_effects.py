"""Weights, masses, pre-sag, springs and damping of a line, effect by effect."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from counted_effects import (
    counts,
    full_line,
    full_problem,
    model_with,
    with_dropper,
)
from small_lines import BARE, mesh_of

from catenary.meshgen.mesh import LineMesh
from catenary.meshgen.topologies.all_topologies import make_line
from catenary.solver.effects.build_model import build
from catenary.solver.problem.problem import Damping
from catenary.solver.statics.form_finding import find_form


@pytest.fixture(scope="module")
def mesh() -> LineMesh:
    return mesh_of(full_line(), 2)


def test_a_slack_dropper_keeps_a_share_only_if_droppers_slacken(mesh: LineMesh) -> None:
    residual = {"residual_dropper_stiffness"}
    assert model_with(residual, mesh).simulated.kept_ratio == 1.0
    both = model_with(residual | {"dropper_slackening"}, mesh).simulated
    assert (both.slackening, both.kept_ratio) == (True, 0.01)


def test_weights_are_those_of_the_masses_that_exist(mesh: LineMesh) -> None:
    """Gravity acts on what the other effects hang on the line, half of a hinged arm included."""
    line, n = full_line(), counts(mesh)
    gravity = 9.81
    wires = line.support_positions[-1] * (
        line.contact_wire.mass_per_length + line.messenger_wire.mass_per_length
    )
    clamps = n["droppers"] * (line.dropper.upper_clamp_mass + line.dropper.lower_clamp_mass)
    droppers = n["droppers"] * line.dropper.mass_per_length * 1.0  # all 1 m long here
    arm = line.steady_arm
    arms = n["arms"] * (0.5 * arm.mass_per_length * arm.length + arm.clamp_mass)
    hanging = {
        frozenset(): wires,
        frozenset({"clamp_mass"}): wires + clamps,
        frozenset({"dropper_mass"}): wires + droppers,
        frozenset({"arm_inertia"}): wires + arms,
        frozenset({"clamp_mass", "dropper_mass", "arm_inertia"}): wires + clamps + droppers + arms,
    }
    for names, mass in hanging.items():
        model = model_with(names | {"gravity"}, mesh)
        vertical = model.weight[model.dofs(np.arange(mesh.n_nodes))]
        assert vertical.sum() == pytest.approx(-gravity * mass, rel=1e-13)


def test_form_finding_knows_pre_sag_and_transitions_only_if_asked(mesh: LineMesh) -> None:
    whole = BARE | {"gravity", "pre_sag", "transition_spans"}
    lower = mesh.droppers[:, 1]
    level, line = 5.08, full_line()
    sag = np.concatenate([np.asarray(span) for span in line.pre_sag])
    profile = make_line(line).wire("contact_wire").profile
    assert profile is not None
    rise = profile.level(mesh.x(lower)) - level
    for names, expected in (
        (whole, level + rise - sag),
        (whole - {"pre_sag"}, level + rise),
        (whole - {"transition_spans"}, level - sag),
        (BARE | {"gravity"}, np.full(lower.size, level)),
    ):
        _, form = find_form(full_problem(names), mesh)
        assert form.height[lower] == pytest.approx(expected, abs=1e-14)
    _, form = find_form(full_problem(BARE), mesh)
    assert not form.dropper_force.any()


def test_droppers_are_springs_of_their_stiffness_or_of_their_length(mesh: LineMesh) -> None:
    lengths = np.linspace(0.8, 1.2, mesh.droppers.shape[0])
    given = full_problem(BARE)
    by_length = with_dropper(given, stiffness=None, axial_stiffness=8e4)
    assert build(given, mesh, lengths).dropper_stiffness == pytest.approx(1e5)
    model = build(by_length, mesh, lengths)
    assert model.dropper_stiffness == pytest.approx(8e4 / lengths, rel=1e-15)
    (links,) = [block for block in model.blocks if block.component == "droppers"]
    assert links.stiffness[3, 0, 1] == pytest.approx(-8e4 / lengths[3], rel=1e-15)
    damped = replace(given, effects=BARE | {"structural_damping"})
    alpha = given.damping.alpha
    assert build(damped, mesh, lengths).dropper_damping == pytest.approx(alpha * 1e5, rel=1e-15)


def test_damping_may_differ_from_component_to_component(mesh: LineMesh) -> None:
    lengths = np.ones(mesh.droppers.shape[0])
    damping = Damping(1e-4, 0.01, {"droppers": (1e-3, 0.0)})
    on = replace(full_problem(BARE | {"structural_damping"}), damping=damping)
    model = build(on, mesh, lengths)
    assert model.damping_of("droppers") == (1e-3, 0.0)
    assert model.damping_of("contact_wire") == (1e-4, 0.01)
    assert not model.damping_is_proportional
    off = build(replace(on, effects=BARE), mesh, lengths)
    assert off.damping_of("droppers") == (0.0, 0.0)
    assert off.damping_is_proportional
