"""Lateral motion under way: against the vertical model, closed forms and a restart; its energy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from measuring import (
    check,
    check_continued,
    continued,
    energies_of_free_motion,
    free_matrices,
    march,
    matrix_of,
    solve_free,
)
from scipy.sparse import linalg as sparse_linalg
from small_lines import (
    HANGING,
    WHOLE,
    ac_simple_line,
    bare_wires,
    mesh_of,
    problem_of,
    train,
)

from catenary.meshgen.mesh import CONTACT_WIRE, MESSENGER_WIRE
from catenary.meshgen.wires import Conductor
from catenary.solver.statics.form_finding import find_form
from catenary.solver.wind import forces_along

LATERAL = frozenset({"lateral_motion"})
EPS = np.finfo(float).eps
PLANE = ("v", "theta_z")


def test_level_arms_and_upright_droppers_leave_the_vertical_plane_a_spring_of_s_over_l() -> None:
    """Nothing joins the planes then: a vertical line whose arms have the stiffness P/l is the same
    to round-off. Arms that carry no weight have no slope."""
    line = ac_simple_line(4)
    arm = replace(line.steady_arm, inclination=0.0)
    line = replace(line, messenger_stagger=line.stagger, steady_arm=arm)
    run = train(70.0, 60.0, 90.0, raise_time=0.2)
    mesh = mesh_of(line, 3)
    problem = problem_of(line, WHOLE | LATERAL, train=run)
    _, form = find_form(problem, mesh)
    assert form.lateral is not None
    pulls = form.lateral.arm_tension
    # The ends hold wires as arms do, but have no kink: the inner arms are not quite alike.
    spring = float(pulls[0]) / arm.length
    check("radial forces [N]", pulls, pulls[0], within=2e-3 * pulls[0])
    flat = replace(line, steady_arm=replace(arm, stiffness=spring))
    both = [march(p, mesh) for p in (problem, problem_of(flat, WHOLE, train=run))]
    # Of the stiffness of an arm, which changes the contact force by some newtons.
    check("contact force [N]", *(h["contact_force"] for h in both), within=2e-3 * 10.0)
    assert np.ptp(both[0]["contact_force"]) > 20.0


def test_uniform_wind_blows_a_staggered_wire_off_as_far_as_its_closed_form() -> None:
    """p L^2 / 8T + (b1 + b2)/2 + T (b2 - b1)^2 / 2 p L^2: the contact wire of Re200 alone over
    80 m at +-0.4 m and 6.5 N/m, 0.597 m."""
    wire, wind, length = Conductor(1e4, 0.89, 0.0), 6.5, 80.0
    line = replace(bare_wires(length, wire), stagger=(0.4, -0.4))
    mesh = mesh_of(line, 80)
    model, form = find_form(problem_of(line, HANGING | LATERAL), mesh)
    load = np.zeros(model.n_dofs)
    unknowns, weights = forces_along(model, CONTACT_WIRE, PLANE)
    load[unknowns] += weights @ np.full(weights.shape[1], wind)
    blown = solve_free(matrix_of(model, stiffness=1.0), model, load)
    nodes = mesh.wires[CONTACT_WIRE]
    assert form.lateral is not None
    found = form.lateral.y[nodes] + blown[model.dofs(nodes, "v")]
    expected = wind * length**2 / (8 * wire.tension)
    expected += wire.tension * 0.8**2 / (2 * wind * length**2)
    # Nodes are a metre apart, the largest deflection up to half of that beside one.
    check("largest deflection [m]", found.max(), expected, within=wind * 0.5**2 / 2 / 1e4 + 1e-9)
    check("published [m]", expected, 0.597, within=5e-4)


def test_lateral_waves_run_as_fast_as_vertical_ones() -> None:
    """The lowest lateral frequency of a bare string is c / 2L, c = sqrt(T / m)."""
    line = bare_wires(60.0, Conductor(2e4, 1.35, 0.0), Conductor(1e9, 1.0, 0.0))
    model, _ = find_form(problem_of(line, HANGING | LATERAL), mesh_of(line, 24))
    mass, stiffness = free_matrices(model)
    found = sparse_linalg.eigsh(stiffness, 2, mass, sigma=0.0, return_eigenvectors=False)
    expected = (np.pi / 60.0 * np.sqrt(2e4 / 1.35)) ** 2
    # The vertical and the lateral one; 24 elements of cubic shape are exact within 1e-7.
    check("squares of frequencies [1/s2]", found, expected, within=1e-6 * expected)


def test_energy_of_leaning_droppers_and_inclined_arms_stays() -> None:
    line = ac_simple_line(3)
    line = replace(line, steady_arm=replace(line.steady_arm, inclination=np.deg2rad(10.0)))
    model, _ = find_form(problem_of(line, HANGING | LATERAL), mesh_of(line, 3))
    load = np.zeros(model.n_dofs)
    load[model.dofs(model.mesh.droppers[[8, 12], 1])] = 200.0
    lifted = solve_free(matrix_of(model, stiffness=1.0), model, load)
    nodes = np.arange(model.mesh.n_nodes)
    assert np.abs(lifted[model.dofs(nodes, "v")]).max() > 1e-3
    n_steps = 4000
    _, total = energies_of_free_motion(model, lifted, np.zeros_like(lifted), n_steps, 500)
    drift = np.abs(total / total[0] - 1).max()
    # Bars of 1e7 N/m beside wires: the condition of a step is a hundred times that of a flat line.
    check("relative change of the energy", drift, 0.0, within=100 * n_steps * EPS)


def test_a_continued_lateral_run_is_the_uninterrupted_one() -> None:
    line = ac_simple_line(4)
    problem = problem_of(line, WHOLE | LATERAL, train=train(70.0, 60.0, 80.0, raise_time=0.1))
    whole, rest = continued(problem, mesh_of(line, 3), 150)
    check_continued(whole, rest, 150, "contact_force", "dropper_force", "arm_uplift")


def test_a_push_upwards_at_an_inclined_arm_moves_the_wire_along_its_bar() -> None:
    """The clamp can only move at right angles to the bar, v = -w tan(a) away from its hinge."""
    line = ac_simple_line(3)
    line = replace(line, steady_arm=replace(line.steady_arm, inclination=np.deg2rad(15.0)))
    model, form = find_form(problem_of(line, HANGING | LATERAL), mesh_of(line, 3))
    arms = model.mesh.steady_arms
    load = np.zeros(model.n_dofs)
    load[model.dofs(arms[:1])] = 100.0
    moved = solve_free(matrix_of(model, stiffness=1.0), model, load)
    w, v = moved[model.dofs(arms[:1])], moved[model.dofs(arms[:1], "v")]
    assert form.lateral is not None
    towards_hinge = np.sign(form.lateral.arm_force[0, 0])
    # The bar gives by its force of some 30 N over 1e7 N/m.
    check("v [m]", v * towards_hinge, -w * np.tan(np.deg2rad(15.0)), within=2e-5)
    assert w > 0.01
    still = model.mesh.wires[MESSENGER_WIRE][[0, -1]]
    assert not moved[model.dofs(still, "v")].any()
