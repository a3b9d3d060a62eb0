"""The default scheme against the paper's fixed-point correction, all nonlinearities in play."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from measuring import History, check, march, start_march
from small_lines import WHOLE, en50318_line, mesh_of, numerics, problem_of, train

from catenary.solver.problem.contact_laws import HertzLaw, LinearLaw
from catenary.solver.problem.problem import Problem


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


@pytest.mark.study
@pytest.mark.parametrize(
    ("effects", "damping", "integrator"),
    [
        (WHOLE, 0.0, "newmark"),
        pytest.param(
            WHOLE | {"contact_damping", "residual_dropper_stiffness"},
            50.0,
            "newmark",
            marks=pytest.mark.study,
        ),
        pytest.param(WHOLE, 0.0, "generalized_alpha", marks=pytest.mark.study),
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
    dropper = problem.line.droppers[0].kind.stiffness / law.stiffness
    check("dropper forces [N]", iterated["dropper_force"], droppers, within=dropper * within)
    # What the default scheme saves.
    assert counters["solves"] == counters["steps"]
    assert iterated.outcome.counters["solves"] > 4 * counters["solves"]


def test_a_fixed_number_of_corrections_goes_on_and_comes_nearer_with_each() -> None:
    """Corrections multiply what is missing by k beta dt^2 (1 / m_head + 1 / m_wire), 0.014 here,
    with m_wire of 0.97 kg for elements of a third of a gap (test_stability_map); where droppers
    slacken by k_d beta dt^2 (1 / m_wire + 1 / m_messenger), 0.058 with wires of 1.35 and 1.07 kg/m.
    Errors of steps add up alike whatever their size, so that they fall by the greater one.
    """
    mesh = mesh_of(en50318_line(8), 3)
    smooth = two_pantographs("fixed_point", WHOLE, 0.0, "newmark")
    smooth = replace(smooth, train=train(250 / 3.6, 120.0, 200.0, raise_time=0.3))
    exact = march(replace(smooth, numerics=numerics(1e-3)), mesh)["contact_force"]
    errors, above = [], []
    for iterations in (1, 2, 3):
        loose = numerics(1e-3, "fixed_point", eps_d=1e-6, eps_v=1e-3, iterations=iterations)
        found = march(replace(smooth, numerics=loose), mesh)
        counters = found.outcome.counters
        assert counters["rounds"] == iterations * counters["steps"]
        errors.append(float(np.abs(found["contact_force"] - exact).max()))
        above.append(counters["unconverged_steps"])
        print(f"{iterations} corrections: {errors[-1]:.2e} N off, {above[-1]} steps not converged")
    # Before the head presses there is nothing to be corrected.
    assert above[0] > 0.8 * exact.size > above[1] > above[2]
    ratio = 1e5 * 0.25e-6 * (1 / 0.97 + 1 / (0.97 * 1.07 / 1.35))
    assert errors[1] < ratio * errors[0] and errors[2] < ratio * errors[1]
    assert errors[2] > 0.0


def test_a_fixed_number_of_corrections_that_diverge_ends_the_run() -> None:
    """A contact of 1e7 N/m at 1 ms multiplies by 2.6 a correction: nothing may go on with that."""
    stiff = replace(
        two_pantographs("fixed_point", WHOLE - {"contact_loss"}, 0.0, "newmark"),
        contact=LinearLaw(1e7, 0.0),
        numerics=numerics(1e-3, "fixed_point", iterations=10),
    )
    run, _ = start_march(stiff, mesh_of(en50318_line(8), 3))
    with run:
        outcome = run.run([])
    print(outcome.outcome)
    assert "the step to t = " in outcome.outcome and "with the train at 1" in outcome.outcome
    assert "diverges" in outcome.outcome
    assert "numerics.iterations is 10" in outcome.outcome and "one_solve" in outcome.outcome


def test_corrections_that_throw_the_line_away_end_the_run_without_contact() -> None:
    """Every first correction presses as a Hertz contact of 2e7 N/m does at a prediction, and
    every second one finds no contact: the force stays zero while the line is thrown kilometres."""
    line = en50318_line(3)
    thrown = problem_of(
        line,
        contact=HertzLaw(8.2e9, 1.5, 0.0, 0.1),
        train=train(250 / 3.6, 30.0, 130.0, raise_time=0.0),
        numerics=numerics(6e-3, "fixed_point", eps_d=1e-6, eps_v=1e-3, iterations=2),
    )
    history = History()
    run, _ = start_march(thrown, mesh_of(line, 5))
    with run:
        outcome = run.run([history])
    print(outcome.outcome)
    assert "diverges" in outcome.outcome and "numerics.iterations is 2" in outcome.outcome
    assert outcome.counters["unconverged_steps"] >= 1
    # Up to there the heads may have lifted it, from 5.5 m, by what a correction of 10 m can.
    assert np.abs(history["wire_height"]).max() < 5.5 + 10.0
