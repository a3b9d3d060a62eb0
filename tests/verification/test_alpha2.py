"""PETSc's TSALPHA2 as an independent second implementation of the same equations.

What the scheme ``ts_alpha2`` (`tests/support/ts_alpha2.py`) shares with the default one are the
matrices M, C and K alone. It takes line and pantographs as one nonlinear system
(`tests/support/monolithic_system.py`), solves it by Newton's method with the generalized-alpha
scheme, and knows neither of predictors, compliances nor of an inner problem. Both methods are of
order 2, so their difference must fall with order 2.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from measuring import check, march, print_table
from monolithic_system import WholeSystem
from small_lines import (
    EN_PANTOGRAPH,
    WHOLE,
    en50318_line,
    mesh_of,
    numerics,
    problem_of,
    train,
)
from ts_alpha2 import TS_ALPHA2

from catenary.meshgen.mesh import CONTACT_WIRE, LineMesh
from catenary.solver.problem.contact_laws import LinearLaw
from catenary.solver.problem.problem import Damping, Problem
from catenary.solver.statics.form_finding import find_form

NOMINAL_HEIGHT = 5.52
START, SPEED = 43.0, 80.0
ALPHA = {"integrator": "generalized_alpha", "spectral_radius": 0.8}


def problem_and_mesh(**changes: Any) -> tuple[Problem, LineMesh]:
    """Two spans, a pantograph that is pressed on so hard that it loses contact now and then."""
    line = en50318_line(2)
    problem = problem_of(
        line,
        WHOLE | {"contact_damping"},
        contact=LinearLaw(5e4, 20.0),
        train=train(
            SPEED,
            START,
            START + 24.0,
            static_force=250.0,
            raise_time=0.05,
            nominal_height=NOMINAL_HEIGHT,
        ),
    )
    return replace(problem, **changes), mesh_of(line, 2)


@pytest.mark.parametrize(
    "ours",
    [pytest.param({}, marks=pytest.mark.study), ALPHA],
    ids=["average acceleration", "generalized alpha"],
)
def test_tsalpha2_integrates_the_same_model_to_the_same_forces(ours: dict[str, Any]) -> None:
    problem, mesh = problem_and_mesh()
    steps, every = [2e-3, 1e-3, 0.5e-3, 0.25e-3], 2e-3
    of_contact, of_droppers = [], []
    for dt in steps:
        own = march(replace(problem, numerics=numerics(dt, **ours)), mesh)
        second = march(replace(problem, numerics=numerics(dt, TS_ALPHA2, **ALPHA)), mesh)
        stride = round(every / dt)
        apart = (second["contact_force"] - own["contact_force"])[::stride]
        of_contact.append(float(np.sqrt((apart**2).mean())))
        apart = (second["dropper_force"] - own["dropper_force"])[::stride]
        of_droppers.append(float(np.sqrt((apart**2).mean())))
    force, droppers = own["contact_force"][:, 0], own["dropper_force"]
    lost, slack = force == 0, droppers == 0
    changes = np.diff(np.column_stack([lost, slack]), axis=0).any(axis=1).sum()
    print(f"contact lost in {lost.sum()} of {lost.size} states, {slack.sum()} slack droppers")
    print(f"{changes} steps with a change; largest contact force {force.max():.1f} N")
    print(second.outcome.counters)
    assert lost[20:].sum() > 50
    assert slack.any(axis=0).sum() >= 3
    assert second.outcome.counters["slack_dropper_steps"] == slack.sum()
    # What disturbs the order between the last two differences: the next term, (omega dt)^2 with
    # the head against half an element of wire on the contact spring; and jumps in the third
    # derivative, whose place within a step is left to chance: the share of steps in which a
    # contact or a dropper changes its state, or the head passes to the next element.
    h = float(np.diff(mesh.x(mesh.wires[CONTACT_WIRE])).min())
    masses = (EN_PANTOGRAPH.masses[0], problem.line.wire(CONTACT_WIRE).mass_per_length * h / 2)
    omega = np.sqrt(problem.contact.stiffness * sum(1 / mass for mass in masses))
    jumps = 2 * changes / lost.size + SPEED * steps[-2] / h
    within = np.log2(1 + (omega * steps[-2]) ** 2 + jumps)
    names = [f"{1e3 * dt:g} ms" for dt in steps]
    for what, differences in (("contact force", of_contact), ("dropper forces", of_droppers)):
        title = f"{what}, rms difference [N]"
        observed = print_table(f"{title}, expected order 2", names, differences)
        # Of the same method the differences in droppers are nothing but those jumps.
        if what == "contact force" or not ours:
            check(f"{title}: order", observed[-1], 2, within=within)
        # And small: of the same size as the error of the step itself, which is (omega dt)^2 / 12
        # of the fluctuation.
        limit = (omega * steps[-1]) ** 2 / 12 * force.max()
        check(f"{title}: at {names[-1]}", differences[-1], 0.0, within=limit)


@pytest.mark.study
@pytest.mark.parametrize(
    "changes",
    [
        {"effects": WHOLE - {"contact_loss"}},
        pytest.param({"effects": WHOLE - {"dropper_slackening"}}, marks=pytest.mark.study),
        pytest.param(
            {
                "effects": WHOLE | {"residual_dropper_stiffness"},
                "residual_stiffness_ratio": 0.1,
                "damping": Damping(1e-4, 0.0125, {"droppers": (1e-3, 0.0)}),
            },
            marks=pytest.mark.study,
        ),
    ],
    ids=["contact that pulls", "droppers that push", "residual stiffness, damping by component"],
)
def test_both_schemes_simulate_the_same_effects(changes: dict[str, Any]) -> None:
    """Two pantographs; at the steps' end states the difference falls with order 2."""
    problem, mesh = problem_and_mesh(**changes)
    followed = replace(problem.train, placements=(problem.train.placements[0],) * 2)
    followed = replace(
        followed,
        placements=(
            followed.placements[0],
            replace(followed.placements[1], behind=11.0),
        ),
    )
    problem = replace(problem, train=followed)
    differences = []
    for dt in (0.5e-3, 0.25e-3):
        runs = [
            march(replace(problem, numerics=numerics(dt, scheme, **ALPHA)), mesh)
            for scheme in ("one_solve", TS_ALPHA2)
        ]
        found = {}
        for channel in ("contact_force", "head_height", "wire_height", "arm_uplift"):
            a, b = (run[channel][:: round(0.5e-3 / dt)] for run in runs)
            found[channel] = np.sqrt(((a - b) ** 2).mean()) / np.ptp(a)
        differences.append(found)
    for channel, coarse in differences[0].items():
        order = np.log2(coarse / differences[1][channel])
        print(f"{channel}: relative difference {coarse:.2e}, order {order:.2f}")
        # The forces fluctuate with the head on the contact spring, where (omega dt)^2 / 12 is
        # 1e-3; motions are slower by far.
        assert coarse < (1e-3 if channel == "contact_force" else 1e-4), channel
        if channel == "contact_force":
            # Jumps leave a tenth of an order open, see the test above.
            check("order", order, 2, within=0.2)


def test_the_jacobian_is_the_derivative_of_the_residual() -> None:
    """Against central differences in random directions, with contact and with slack droppers."""
    problem, mesh = problem_and_mesh()
    model, form = find_form(problem, mesh)
    system = WholeSystem(problem, model, form, lambda place: NOMINAL_HEIGHT, None)
    rng = np.random.default_rng(1)
    u, v, a = np.zeros((3, system.n))
    u[system.n_line :] = form.height.max() + 0.02 - NOMINAL_HEIGHT
    uppers = model.dofs(mesh.droppers)[:, 0]
    u[uppers[::2]] -= 0.05
    v[:] = 1e-3 * rng.standard_normal(system.n)
    u[model.constrained] = v[model.constrained] = 0.0
    assert system.contacts(0.2, u, v)[0][0] > 100.0
    slack = system.reserve(u, v) < 0
    assert slack.any() and not slack.all()
    by_v, by_a = 2.0 / 1e-3, 4.0 / 1e-6
    values = system.jacobian(0.2, u, v, by_v, by_a)
    for _ in range(5):
        way = 1e-7 * rng.standard_normal(system.n)
        ahead, behind = (
            system.residual(0.2, u + s * way, v + s * by_v * way, a + s * by_a * way)
            for s in (1.0, -1.0)
        )
        product = np.zeros(system.n)
        rows = np.repeat(np.arange(system.n), np.diff(system.indptr))
        np.add.at(product, rows, values * way[system.indices])
        # Piecewise linear, so that only round-off of forces of up to 1e6 N is left.
        scale = np.abs(ahead).max()
        check("directional derivative [N]", 0.5 * (ahead - behind), product, within=1e-9 * scale)
