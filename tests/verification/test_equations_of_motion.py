"""Every state of a march put into the equations of motion, all laws written out once more."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from measuring import History, check, matrix_of, start_march
from small_lines import (
    WHOLE,
    ac_simple_line,
    mesh_of,
    numerics,
    problem_of,
    train,
)

from catenary.meshgen.mesh import CONTACT_WIRE, LineMesh
from catenary.solver.model.beam import shape_slopes, shape_values
from catenary.solver.problem.contact_laws import LinearLaw
from catenary.solver.problem.problem import Problem, Train
from catenary.solver.statics.form_finding import find_form

EPS = np.finfo(float).eps


RUN = train(85.0, 110.0, 165.0, behind=(0.0, 31.0), static_force=220.0, raise_time=0.1)
# Two heads below droppers of the third span.
BELOW = train(20.0, 126.0, 129.0, behind=(0.0, 11.5), static_force=100.0, raise_time=0.0)
# Two heads beside each other. Where contacts pull, what neither slackens alone both do.
CLOSE = train(85.0, 110.0, 165.0, behind=(0.0, 0.5), static_force=50.0, raise_time=0.1)
THROW = 8.0  # [m/s]


def watched(
    problem: Problem, mesh: LineMesh, start: dict[str, Any] | None = None, n_steps: int = 0
) -> History:
    """All states of a march from ``start`` on, or of its first ``n_steps``."""
    run, _ = start_march(problem, mesh)
    if start is not None:
        run.restore(start)
    history = History(lambda view: view.checkpoint())
    history.outcome = run.run([history], lambda: len(history.time) == n_steps)
    run.destroy()
    return history


def thrown(problem: Problem, mesh: LineMesh) -> History:
    """Heads that arrive at speed: taut droppers go slack within the first, long steps."""
    start = watched(problem, mesh, n_steps=1).watched[0]
    for number in range(2):
        start[f"pantograph_{number}"][2] = THROW  # after the heights of two masses
    return watched(problem, mesh, start)


@pytest.mark.parametrize(
    ("scheme", "kept", "moves", "dt"),
    [
        ("one_solve", 0.0, RUN, 1e-3),
        pytest.param("one_solve", 0.01, RUN, 1e-3, marks=pytest.mark.study),
        ("one_solve", 0.0, RUN, 4e-3),
        ("one_solve", 0.0, BELOW, 4e-3),
        ("one_solve, pulling", 0.0, CLOSE, 4e-3),
        ("fixed_point", 0.0, RUN, 1e-3),
        pytest.param("fixed_point", 0.01, RUN, 1e-3, marks=pytest.mark.study),
    ],
    ids=[
        "one solve",
        "one solve, residual stiffness",
        "one solve, long steps",
        "one solve, thrown against the wire",
        "one solve, contacts that pull",
        "fixed point",
        "fixed point, residual stiffness",
    ],
)
def test_states_satisfy_the_equations_of_motion(
    scheme: str, kept: float, moves: Train, dt: float
) -> None:
    """M a + C v + K u = sum of f N - sum of s L, f = max(0, k g + c g'), s = (1 - r) max(0, -T).

    Contacts that pull have f = k g + c g'. g = z - h; h' = dw/dt + V dw/dx; T as if droppers could
    push, with their damping.
    """
    line = ac_simple_line(5)
    mesh = mesh_of(line, 3)
    law = LinearLaw(5e4, 60.0)
    scheme, _, pulls = scheme.partition(", ")
    effects = WHOLE | {"contact_damping", "residual_dropper_stiffness"}
    problem = problem_of(
        line,
        effects - {"contact_loss"} if pulls else effects,
        contact=law,
        train=moves,
        numerics=numerics(dt, scheme),
        residual_stiffness_ratio=kept,
    )
    model, form = find_form(problem, mesh)
    history = thrown(problem, mesh) if moves is BELOW else watched(problem, mesh)
    mass, damping, stiffness = (
        matrix_of(model, **{name: 1.0}) for name in ("mass", "damping", "stiffness")
    )
    ends = model.dofs(mesh.droppers)
    nodes = mesh.wires[CONTACT_WIRE]
    x = mesh.x(nodes)
    unknowns = np.stack([model.dofs(nodes), model.dofs(nodes, "theta_y")], axis=1)
    rest = np.stack([form.height[nodes], form.slope[nodes]], axis=1)
    worst_motion = worst_contact = worst_shown = largest = 0.0
    n_slack = n_lost = 0
    for step, state in enumerate(history.watched):
        if step == 0:
            continue
        u, v, a = state["displacement"], state["velocity"], state["acceleration"]
        residual = mass @ a + damping @ v + stiffness @ u
        scale = abs(mass) @ abs(a) + abs(damping) @ abs(v) + abs(stiffness) @ abs(u)
        spread = u[ends[:, 0]] - u[ends[:, 1]]
        spread_rate = v[ends[:, 0]] - v[ends[:, 1]]
        tension = form.dropper_force + model.dropper_stiffness * spread
        tension += model.dropper_damping * spread_rate
        slack = (1.0 - kept) * np.maximum(0.0, -tension)
        np.add.at(residual, ends[:, 0], slack)
        np.add.at(residual, ends[:, 1], -slack)
        shown = np.where(tension > 0, tension, kept * tension)
        worst_shown = max(worst_shown, np.abs(history["dropper_force"][step] - shown).max())
        n_slack += np.count_nonzero(slack)
        for i, force in enumerate(history["contact_force"][step]):
            position = history["contact_position"][step, i]
            e = int(np.searchsorted(x, position)) - 1
            length = x[e + 1] - x[e]
            value = shape_values((position - x[e]) / length, length)
            slope = shape_slopes((position - x[e]) / length, length)
            own = unknowns[e : e + 2].ravel()
            shape = u[own] + rest[e : e + 2].ravel()
            z, _, head_speed = state[f"pantograph_{i}"][[0, 1, 2]]
            gap = z - value @ shape
            rate = head_speed - (value @ v[own] + problem.train.speed * slope @ shape)
            expected = law.stiffness * gap + law.damping * rate
            n_lost += expected < 0.0
            if not pulls:
                expected = max(0.0, expected)
            worst_contact = max(worst_contact, abs(expected - force))
            residual[own] -= force * value
        residual[model.constrained] = 0.0
        worst_motion = max(worst_motion, np.abs(residual).max())
        largest = max(largest, scale.max())
    print(f"{n_slack} times a slack dropper, {n_lost} times contact lost, or a head that pulls")
    assert n_slack > 50
    assert n_lost > 3
    # Round-off: a row has up to 16 entries; a gap is the difference of two heights of 5 m, from a
    # few operations each. The fixed-point correction stops when displacements change by less
    # than eps_d and velocities by less than eps_v, which forces see through their stiffnesses.
    loose = scheme == "fixed_point"
    eps_d, eps_v = (problem.numerics.eps_d, problem.numerics.eps_v) if loose else (0.0, 0.0)
    of_contact = law.stiffness * eps_d + law.damping * eps_v
    of_droppers = model.dropper_stiffness.max() * eps_d + model.dropper_damping.max() * eps_v
    check("residual of motion [N]", worst_motion, 0.0, within=16 * EPS * largest + of_droppers)
    gap_round_off = 8 * EPS * line.contact_height * law.stiffness
    check("contact law [N]", worst_contact, 0.0, within=gap_round_off + of_contact)
    # Displacements are sums of predictions and corrections, in one order here, in another there; a
    # dropper's stiffness times the difference of two of them is what its force is known to.
    furthest = max(np.abs(state["displacement"]).max() for state in history.watched)
    known_to = model.dropper_stiffness.max() * furthest + np.abs(history["dropper_force"]).max()
    dropper_round_off = 8 * EPS * known_to
    check("forces of droppers [N]", worst_shown, 0.0, within=dropper_round_off)
