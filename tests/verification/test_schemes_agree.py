"""The default scheme against the paper's fixed-point correction, all nonlinearities in play."""

from __future__ import annotations

import numpy as np
import pytest
from measuring import History, check, march
from small_lines import WHOLE, en50318_line, mesh_of, numerics, problem_of, train

from catenary.solver.contact_laws import LinearLaw
from catenary.solver.problem import Problem


def two_pantographs(
    scheme: str, effects: frozenset[str], damping: float, integrator: str
) -> Problem:
    """Two pantographs 31 m apart, fast enough to lose contact now and then."""
    return problem_of(
        en50318_line(8),
        effects,
        contact=LinearLaw(5e4, damping),
        train=train(320 / 3.6, 120.0, 330.0, behind=(0.0, 31.0), raise_time=0.3),
        numerics=numerics(1e-3, scheme, integrator=integrator, spectral_radius=0.8),
        residual_stiffness_ratio=0.01,
    )


@pytest.mark.parametrize(
    ("effects", "damping", "integrator"),
    [
        (WHOLE, 0.0, "newmark"),
        (WHOLE | {"contact_damping", "residual_dropper_stiffness"}, 50.0, "newmark"),
        (WHOLE, 0.0, "generalized_alpha"),
    ],
    ids=["usual effects", "with contact damping and residual stiffness", "generalized alpha"],
)
def test_one_solve_is_the_limit_of_the_fixed_point_correction(
    effects: frozenset[str], damping: float, integrator: str
) -> None:
    mesh = mesh_of(en50318_line(8), 4)
    runs: dict[str, History] = {}
    for scheme in ("one_solve", "fixed_point"):
        problem = two_pantographs(scheme, effects, damping, integrator)
        runs[scheme] = march(problem, mesh)
    direct, iterated = runs["one_solve"], runs["fixed_point"]
    force, droppers = direct["contact_force"], direct["dropper_force"]
    lost = int((force[300:] == 0).sum())
    counters = direct.outcome.counters
    print(f"{lost} contact losses, {counters['slack_dropper_steps']} slack droppers in all steps")
    print("one_solve  ", counters)
    print("fixed_point", iterated.outcome.counters)
    assert lost > 10
    assert counters["slack_dropper_steps"] > 1000
    assert iterated.outcome.counters["unconverged_steps"] == 0
    # The iteration ends when a displacement changes by less than eps_d or a velocity by eps_v:
    # the contact force is then off by k eps_d + c eps_v, a dropper's by its stiffness times as
    # much. Such errors stay in the motion, and n steps of either sign add up to sqrt(n) of them.
    law, accuracy = problem.contact, problem.numerics
    of_step = law.stiffness * accuracy.eps_d + law.damping * accuracy.eps_v
    within = np.sqrt(force.shape[0]) * of_step
    check("contact forces [N]", iterated["contact_force"], force, within=within)
    dropper = problem.line.dropper.stiffness / law.stiffness
    check("dropper forces [N]", iterated["dropper_force"], droppers, within=dropper * within)
    # What the default scheme saves.
    assert counters["solves"] == counters["steps"]
    assert iterated.outcome.counters["solves"] > 4 * counters["solves"]
