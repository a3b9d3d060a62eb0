"""Pantographs that are lowered during a run: off the wire, down, caught."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import paper_pantograph as paper
import pytest
from measuring import History, check, start_march
from small_lines import (
    EN_PANTOGRAPH,
    FREE_MASS,
    WHOLE,
    en50318_line,
    mesh_of,
    numerics,
    problem_of,
    train,
)

from catenary.cases.scene.input.case_files import read_toml
from catenary.cases.scene.scene import pantograph_of
from catenary.cases.scene.train.pantograph import MultibodyTable
from catenary.mbs.build import PantographData
from catenary.mbs.head.stepping import Lowering
from catenary.mbs.lumped import LumpedData
from catenary.solver.problem.problem import Damping, Problem

TELESCOPE = Path(__file__).parents[1] / "support" / "telescope.toml"
FORCE, PULL, AT, WITHIN, DROP = 120.0, -80.0, 0.5, 0.2, 0.3
LOWERING = Lowering(AT, PULL, WITHIN, DROP)
EPS = np.finfo(float).eps


def problem(
    data: PantographData, end: float, lowering: Lowering | None = LOWERING, **changes: Any
) -> Problem:
    """A pantograph at 50 m/s from 70 m on below the reference line, five spans."""
    running = train(
        50.0, 70.0, end, data=data, static_force=FORCE, nominal_height=5.55, raise_time=0.2
    )
    placement = replace(running.placements[0], lowering=lowering)
    return problem_of(
        en50318_line(5),
        WHOLE | {"lowering"},
        **{
            "train": replace(running, placements=(placement,)),
            "numerics": numerics(1e-3),
            "damping": Damping(1e-3, 1.0),
            **changes,
        },
    )


def run(made: Problem, kept: dict[str, Any] | None = None, keep_at: int = -1) -> History:
    """March to the end, from ``kept`` or the start, with checkpoints at ``keep_at``."""
    march, _ = start_march(made, mesh_of(made.line, 3))
    if kept is not None:
        march.restore({name: np.array(value) for name, value in kept.items()})
    history = History(lambda view: view.checkpoint() if view.step == keep_at else None)
    with march:
        assert march.run([history]).outcome == "done"
    return history


def telescope() -> PantographData:
    raw = read_toml(TELESCOPE)["pantographs"]["telescope"]
    return pantograph_of("telescope", MultibodyTable.model_validate(raw), 250.0)


MODELS = {
    "two masses": lambda: EN_PANTOGRAPH,
    "one mass": lambda: FREE_MASS,
    "reduced mechanism": lambda: paper.data(),
    "all bodies": lambda: paper.data(motion="all_bodies"),
}


@pytest.mark.parametrize("make", MODELS.values(), ids=MODELS.keys())
def test_the_head_leaves_the_wire_goes_down_and_is_caught(make: Any) -> None:
    made = problem(make(), 145.0)
    seen = run(made)
    time = np.array(seen.time)
    force, height = seen["contact_force"][:, 0], seen["head_height"][:, 0]
    before = int(np.argmin(np.abs(time - AT)))
    assert force[before - 50 : before + 1].min() > 0.0
    left = before + int(np.argmax(force[before:] == 0.0))
    # Half of the way of the force is enough for a head that nothing else pushes up.
    assert AT < time[left] < AT + 2 * WITHIN
    assert not force[left:].any()
    caught = height[before] - DROP
    down = int(np.argmax(height <= caught + 1e-12))
    assert left < down < time.size - 50
    check("where it is caught [m]", height[down + 1 :], caught, within=100 * EPS * 6.0)
    assert (height[: down + 1] > caught - 0.01).all()  # a step's way at the speed of the fall
    falling = height[left : down + 1]
    assert falling.argmax() < 0.2 * falling.size
    # Behind the head the line calms down: over a span's worth of time with damping of 1/s on mass,
    # exp(-t/2), the largest uplift falls.
    uplift = np.abs(seen["arm_uplift"]).max(axis=1)
    assert uplift[left:].max() > 2e-3
    assert uplift[-100:].max() < 0.7 * uplift[left:].max()


def test_a_free_mass_falls_as_its_force_wants() -> None:
    """m z'' = F(t): after the force has gone over to its last value, a parabola.

    Average acceleration is exact under a constant force, but for round-off of heights of 5 m.
    """
    seen = run(problem(FREE_MASS, 110.0, Lowering(AT, PULL, WITHIN, 2.0)), keep_at=720)
    time, height = np.array(seen.time), seen["head_height"][:, 0]
    state = next(kept for kept in seen.watched if kept is not None)["pantograph_0"]
    place, velocity, acceleration = state[:3]
    check("acceleration [m/s2]", acceleration, PULL / FREE_MASS.masses[0], within=1e-9)
    later = time[720:] - time[720]
    closed = place + velocity * later + 0.5 * PULL / FREE_MASS.masses[0] * later**2
    assert later.size == 81 and velocity < -0.5
    check("height [m]", height[720:], closed, within=6.0 * EPS * 80**2)


def test_a_telescope_is_lowered_as_the_two_masses_that_it_is() -> None:
    """Within what separates them when raised: see test_multibody_in_a_run.py."""
    found = run(problem(telescope(), 130.0))
    expected = run(problem(LumpedData((7.2, 15.0), (4200.0, 0.0), (10.0, 90.0)), 130.0))
    check("contact force [N]", found["contact_force"], expected["contact_force"], within=1e-7)
    check("head [m]", found["head_height"], expected["head_height"], within=1e-9)
    assert np.ptp(expected["head_height"]) > 0.9 * DROP


@pytest.mark.parametrize("at", [450, 500, 700, 1300])
@pytest.mark.parametrize(
    "make", [MODELS["two masses"], MODELS["reduced mechanism"]], ids=["masses", "mechanism"]
)
def test_a_continued_run_is_the_uninterrupted_one(make: Any, at: int) -> None:
    """From before the lowering, its first step, the fall, and when it is caught."""
    made = problem(make(), 140.0)
    whole = run(made, keep_at=at)
    kept = next(kept for kept in whole.watched if kept is not None)
    rest = run(made, kept)
    for channel in ("contact_force", "head_height", "wire_height", "arm_uplift"):
        expected = whole[channel][at:]
        check(channel, rest[channel], expected, within=1e-12 * np.abs(whole[channel]).max())


def test_only_the_pantograph_that_is_meant_is_lowered() -> None:
    made = problem(EN_PANTOGRAPH, 165.0, None)
    first = made.train.placements[0]
    both = replace(
        made.train,
        start=101.0,
        placements=(replace(first, lowering=LOWERING), replace(first, behind=31.0)),
    )
    seen = run(replace(made, train=both))
    late = np.array(seen.time) > AT + 2 * WITHIN
    assert late.sum() > 30
    force = seen["contact_force"][late]
    assert not force[:, 0].any()
    assert force[:, 1].mean() > 0.5 * FORCE


def test_the_effect_left_out_lowers_nothing() -> None:
    made = problem(EN_PANTOGRAPH, 110.0)
    off = run(replace(made, effects=made.effects - {"lowering"}))["contact_force"]
    never = run(problem(EN_PANTOGRAPH, 110.0, None))["contact_force"]
    assert (off == never).all()
    assert (run(made)["contact_force"] != never).any()
