"""What makes steps of a line slower than they could be, as plan, log and march tell it."""

from __future__ import annotations

import logging

import numpy as np
import pytest
from measuring import start_march
from small_lines import WHOLE, en50318_line, mesh_of, numerics, problem_of, train

from catenary.cases.run.plan import make_plan, plan_text
from catenary.cases.scene.cost_model import STATION_COST, cost_of_widths, estimate_march
from catenary.cases.scene.load import load_scene
from catenary.solver.effects.build_model import numbering_of
from catenary.solver.integrators import detour
from catenary.solver.integrators.detour import PARTS, detour_of
from catenary.solver.problem.problem import Damping

HHT = 'numerics.integrator="hht"', "numerics.spectral_radius=0.8"
BY_COMPONENT = "line.damping.per_component={contact_wire={alpha_s=0.01,beta_per_s=0.02}}"


def test_the_plan_says_what_makes_steps_slower_and_by_how_much() -> None:
    plain, damped, slow = (
        make_plan(load_scene("en50318_2002", more))
        for more in ([], [*HHT, BY_COMPONENT], ['numerics.coupling="explicit"'])
    )
    for plan in (plain, damped):
        assert plan.detour == "" and "slower" not in plan_text(plan)
    assert "numerics.coupling" in slow.detour
    assert slow.detour in plan_text(slow)
    assert slow.march == pytest.approx(PARTS * plain.march)


def test_log_and_outcome_of_a_march_say_the_same(
    caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Warnings are given once a process, of which other tests are a part.
    monkeypatch.setattr(detour, "_told", set())
    damping = Damping(1e-4, 0.0125, {"contact_wire": (2e-3, 0.3)})
    line = en50318_line(3)
    for coupling, slower in (("implicit", False), ("explicit", True)):
        steps = numerics(1e-3, integrator="hht", spectral_radius=0.8, coupling=coupling)
        problem = problem_of(
            line, WHOLE, damping=damping, train=train(70.0, 70.0, 70.5), numerics=steps
        )
        caplog.clear()
        with caplog.at_level(logging.WARNING):
            marched, _ = start_march(problem, mesh_of(line, 3))
            with marched:
                outcome = marched.run([])
        assert bool(outcome.detour) is slower
        assert [record.message for record in caplog.records] == [outcome.detour] * slower
        told = detour_of(problem, numbering_of(problem, mesh_of(line, 3)))
        assert (str(told) if told else "") == outcome.detour


def test_estimates_know_the_widths_of_stations() -> None:
    assert cost_of_widths((4,)) == 1.0
    assert cost_of_widths((4, 4)) == pytest.approx(1.0)
    assert cost_of_widths((8,)) == pytest.approx(0.5 * STATION_COST[8])
    step = [estimate_march(n, 1, "one_solve", 0, (width,)) for n, width in ((4000, 4), (12000, 12))]
    empty = estimate_march(0, 1, "one_solve")
    assert np.diff(np.array(step) - empty)[0] > 0
    ratio = (step[1] - empty) / (step[0] - empty)
    assert ratio == pytest.approx(STATION_COST[12])
