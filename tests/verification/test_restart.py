"""A run that is continued from a checkpoint is the run that was never interrupted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from measuring import check, check_continued, continued, march
from small_lines import EN_PANTOGRAPH, WHOLE, en50318_line, mesh_of, numerics, problem_of, train

from catenary.mbs.head.laws import Law, Regulation
from catenary.solver.problem.contact_laws import LinearLaw
from catenary.solver.problem.problem import steps_of


@pytest.mark.parametrize(
    "integrator", [pytest.param("newmark", marks=pytest.mark.study), "generalized_alpha"]
)
@pytest.mark.parametrize("scheme", ["one_solve", "fixed_point"])
def test_continued_run_equals_the_uninterrupted_one(scheme: str, integrator: str) -> None:
    line = en50318_line(6)
    mesh = mesh_of(line, 3)
    problem = problem_of(
        line,
        WHOLE | {"contact_damping"},
        contact=LinearLaw(5e4, 50.0),
        train=train(70.0, 120.0, 180.0, behind=(0.0, 31.0), raise_time=0.3),
        numerics=numerics(1e-3, scheme, integrator=integrator, spectral_radius=0.6),
    )
    whole, rest = continued(problem, mesh, 400)
    assert rest.stage.start_time == pytest.approx(400 * problem.numerics.dt, rel=1e-15)
    channels = ("contact_force", "head_height", "wire_height", "dropper_force", "arm_uplift")
    check_continued(whole, rest, 400, "contact_position", *channels)


def test_laws_and_regulators_go_on_where_they_were() -> None:
    """The controller's integral, what waits for its delay, contact forces of the step before."""
    line = en50318_line(6)
    law = Law(1, 2, True, (-1.0, 0.0, 1.0), (-30.0, 0.0, 200.0))
    data = replace(EN_PANTOGRAPH, laws=(law,))
    gains = ((0.0, 0.2, 3.0, 0.001),)
    regulator = Regulation(False, 130.0, gains, -50.0, 50.0, 5e-3, 0.02, 0.05)
    ours = train(70.0, 120.0, 150.0, data=data, raise_time=0.1)
    (place,) = ours.placements
    ours = replace(ours, placements=(replace(place, regulator=regulator),))
    names = WHOLE | {"contact_damping", "pantograph_laws", "regulated_lift"}
    contact, steps = LinearLaw(5e4, 50.0), numerics(1e-3, "one_solve")
    problem = problem_of(line, names, contact=contact, train=ours, numerics=steps)
    mesh, at = mesh_of(line, 3), 203
    whole, rest = continued(problem, mesh, at)
    plain = np.array(whole["contact_force"][at:])
    check("contact force [N]", rest["contact_force"], plain, within=1e-9)
    forgetful = dict(whole.watched[at])
    (name,) = (key for key in forgetful if key.startswith("pantograph_"))
    forgetful[name] = np.array(forgetful[name])
    forgetful[name][-7:] = 0.0  # without what the controller remembers the run is another one
    changed = march(problem, mesh, since=forgetful)
    assert np.abs(np.array(changed["contact_force"]) - plain).max() > 0.1


def test_step_numbers_go_on() -> None:
    """A longer run picks up where the shorter one ended, so that files can be appended to."""
    line = en50318_line(3)
    mesh = mesh_of(line, 2)
    problem = problem_of(line, train=train(70.0, 70.0, 71.0))
    first = march(problem, mesh, lambda view: view.checkpoint())
    longer = replace(problem, train=replace(problem.train, end=72.0))
    second = march(longer, mesh, lambda view: view.step, since=first.watched[-1])
    assert second.watched == list(range(len(first.time) - 1, steps_of(longer) + 1))
