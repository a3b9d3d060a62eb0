"""All bodies of the paper's pantograph under a line: against the reduced ones, joints, restart."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import paper_pantograph as paper
import pytest
from measuring import History, check, start_march
from small_lines import WHOLE, en50318_line, mesh_of, numerics, problem_of, train

from catenary.solver.problem.problem import Problem

FORCE, HEIGHT, RAISED = 150.0, 5.55, 0.5


def problem(end: float, **changes: Any) -> Problem:
    """The paper's pantograph at 70 m/s from 70 m on below the reference line, six spans."""
    running = train(
        70.0,
        70.0,
        end,
        data=paper.data(**changes),
        static_force=FORCE,
        nominal_height=HEIGHT,
        raise_time=RAISED,
    )
    return problem_of(en50318_line(6), WHOLE, train=running, numerics=numerics(1e-3))


def run(made: Problem, kept: dict[str, Any] | None = None, keep_at: int = -1) -> History:
    """March to the end, from ``kept`` or the start; the state of step ``keep_at`` is watched."""

    def watch(view: Any) -> Any:
        checkpoint = view.checkpoint() if view.step == keep_at else None
        return view.constraint_violation.copy(), checkpoint

    march, _ = start_march(made, mesh_of(made.line, 3))
    if kept is not None:
        march.restore({name: np.array(value) for name, value in kept.items()})
    history = History(watch)
    assert march.run([history]).outcome == "done"
    march.destroy()
    return history


def violations(history: History) -> np.ndarray:
    return np.array([violation for violation, _ in history.watched])


def test_reduced_pantograph_runs_as_all_its_bodies() -> None:
    """The reduced head is not carried along the track: 1 % of the force's swing.

    So it is below a wire that moves by itself, as `test_multibody_full.py` finds. Here the swing
    of the line itself is the larger part, which both share. Reduced alone there are no joints.
    """
    full, reduced = run(problem(250.0, motion="all_bodies")), run(problem(250.0))
    late = np.array(full.time) > 2 * RAISED
    force, other = (found["contact_force"][late, 0] for found in (full, reduced))
    print(f"all bodies: {force.mean():.2f} N, sigma {force.std():.3f} N")
    assert force.std() > 10.0
    check("sigma [N]", other.std(), force.std(), within=0.01 * force.std())
    check("mean [N]", other.mean(), force.mean(), within=0.01 * force.std())
    assert (force != other).any()
    assert full.stage is not None and full.stage.train.joints_in_loop
    assert 0.0 < violations(full).max() < 1e-9
    assert reduced.stage is not None and not reduced.stage.train.joints_in_loop
    assert np.isnan(violations(reduced)).all()


@pytest.mark.parametrize(
    "method", [pytest.param("augmented_lagrangian", marks=pytest.mark.study), "baumgarte"]
)
def test_ways_of_keeping_joints_agree_in_a_run(method: str) -> None:
    """They differ by h^4 a step and by what is left open: below 1e-3 N of 150 N, joints 1e-9 m.

    As below a wire that does not give way, in `test_multibody_full.py`.
    """
    chosen = run(problem(105.0, motion="all_bodies", constraint_handling=method))
    usual = run(problem(105.0, motion="all_bodies"))
    check("force [N]", chosen["contact_force"], usual["contact_force"], within=1e-3)
    assert (chosen["contact_force"] != usual["contact_force"]).any()
    assert violations(chosen).max() < 1e-9


@pytest.mark.study
def test_substeps_are_taken() -> None:
    """Four substeps differ from one by the rule's error: a phase of (w h)^2 / 12 w t.

    w = 80 1/s of the head on the contact, h = 1 ms and t = 0.5 s give 0.02 rad of a force that
    grows to 150 N and swings by no more than that.
    """
    one, four = (run(problem(105.0, motion="all_bodies", substeps=n)) for n in (1, 4))
    check("force [N]", one["contact_force"], four["contact_force"], within=3.0)
    assert np.abs(one["contact_force"] - four["contact_force"]).max() > 1e-6


def test_continued_run_is_the_uninterrupted_one() -> None:
    """The same operations on the same numbers, beside a pantograph of lumped masses."""
    made, at = problem(110.0, motion="all_bodies", substeps=2), 250
    lumped = train(70.0, 110.0, 150.0, behind=(1.5,)).placements
    both = replace(made.train, placements=made.train.placements + lumped, start=72.0)
    made = replace(made, train=both)
    whole = run(made, keep_at=at)
    rest = run(made, kept=whole.watched[at][1])
    assert len(rest.time) == len(whole.time) - at > 100
    for channel in ("contact_force", "head_height"):
        expected = whole[channel][at:]
        assert expected.shape[1] == 2
        check(channel, rest[channel], expected, within=1e-12 * np.abs(expected).max())
    np.testing.assert_array_equal(violations(rest), violations(whole)[at:])
    assert np.isnan(violations(rest)[:, 1]).all() and (violations(rest)[:, 0] > 0.0).all()
