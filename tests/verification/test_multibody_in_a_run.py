"""Multibody pantographs under a wire: beside lumped masses that they are, and all their bodies."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import paper_pantograph as paper
import pytest
from measuring import History, check, check_continued, continued, march
from small_lines import WHOLE, en50318_line, mesh_of, numerics, problem_of, train

from catenary.cases.scene.input.case_files import read_toml
from catenary.cases.scene.scene import pantograph_of
from catenary.cases.scene.train.pantograph import MultibodyTable
from catenary.mbs.build import PantographData
from catenary.mbs.lumped import LumpedData
from catenary.mbs.mechanism.multibody_pantograph import MultibodyData, reduced, stand

TELESCOPE = Path(__file__).parents[1] / "support" / "telescope.toml"


def telescope() -> MultibodyData:
    raw = read_toml(TELESCOPE)["pantographs"]["telescope"]
    data = pantograph_of("telescope", MultibodyTable.model_validate(raw), 250.0)
    assert isinstance(data, MultibodyData)
    return data


def run_under(
    data: PantographData, static_force: float, height: float | None, end: float = 290.0
) -> History:
    """Four spans of the reference line at 70 m/s, or up to a place [m]."""
    line = en50318_line(6)
    running = train(70.0, 70.0, end, data=data, static_force=static_force, nominal_height=height)
    problem = problem_of(line, WHOLE, train=running, numerics=numerics(1e-3))
    return march(problem, mesh_of(line, 4), lambda view: view.constraint_violation.copy())


def test_telescope_runs_as_the_two_masses_that_it_is() -> None:
    """The same equations by the same scheme.

    What differs: the calibration, good to 1e-9 of 120 N, and round-off of heights of 5 m, 1e-15,
    on 50 kN/m over 3000 steps. Both are below a part in 2e9 of forces of 200 N.
    """
    found = run_under(telescope(), 120.0, None)
    expected = run_under(LumpedData((7.2, 15.0), (4200.0, 0.0), (10.0, 90.0)), 120.0, None)
    force = expected["contact_force"][:, 0]
    assert force.std() > 10.0
    check("contact force [N]", found["contact_force"][:, 0], force, within=1e-7)
    check("head [m]", found["head_height"], expected["head_height"], within=1e-9)


def test_paper_s_pantograph_runs_nearly_as_its_tables_at_the_working_height() -> None:
    """Mass, damping and slope of the lift frozen where the arm works: a chain of two masses.

    Over the heights that the arm runs through the mass changes by a few parts in a hundred, and
    the contact force, in which the line's share is as large, by less than that. The slope of the
    lift changes by less than the mass does, and moves less.
    """
    data = paper.data()
    standing, tables = stand(data), reduced(data)
    (mass, _, damping), (_, slope, _) = tables.at(standing.working_height)
    head = standing.head
    equivalent = LumpedData((head.mass, mass), (head.stiffness, -slope), (head.damping, damping))
    height = 5.55
    found = run_under(data, standing.static_force, height)
    expected = run_under(equivalent, standing.static_force, height)
    heads = found["head_height"][:, 0]
    arms = standing.working_height + heads - height
    masses = [tables.at(arm)[0][0] for arm in (arms.min(), arms.max())]
    change = float(np.abs(np.array(masses) / mass - 1.0).max())
    print(f"arm {arms.min():.3f} to {arms.max():.3f} m, mass {masses} kg")
    assert 0.0 < change < 0.06
    late = np.array(found.time) > 1.0
    ours, theirs = (run["contact_force"][late, 0] for run in (found, expected))
    check("mean [N]", ours.mean(), theirs.mean(), within=change * theirs.std())
    check("deviation [N]", ours.std(), theirs.std(), within=change * theirs.std())
    assert ours.std() != theirs.std()


def test_reduced_pantograph_runs_as_all_its_bodies() -> None:
    """The reduced head is not carried along the track: 1 % of the force's swing.

    So it is below a wire that moves by itself, as `test_multibody_full.py` finds. Here the swing
    of the line itself is the larger part, which both share. Reduced alone there are no joints.
    """
    full = run_under(paper.data(motion="all_bodies"), 150.0, 5.55)
    reduced = run_under(paper.data(), 150.0, 5.55)
    late = np.array(full.time) > 1.0
    force, other = (found["contact_force"][late, 0] for found in (full, reduced))
    print(f"all bodies: {force.mean():.2f} N, sigma {force.std():.3f} N")
    assert force.std() > 10.0
    check("sigma [N]", other.std(), force.std(), within=0.01 * force.std())
    check("mean [N]", other.mean(), force.mean(), within=0.01 * force.std())
    assert (force != other).any()
    assert full.stage is not None and full.stage.train.joints_in_loop
    assert 0.0 < np.max(full.watched) < 1e-9
    assert reduced.stage is not None and not reduced.stage.train.joints_in_loop
    assert np.isnan(reduced.watched).all()


@pytest.mark.parametrize(
    ("changes", "within"), [({"constraint_handling": "baumgarte"}, 1e-3), ({"substeps": 4}, 3.0)]
)
def test_ways_to_step_bodies_are_taken(changes: dict[str, Any], within: float) -> None:
    """They differ by what `test_multibody_full.py` derives below a wire that does not give way."""
    usual, chosen = (
        run_under(paper.data(motion="all_bodies", **own), 150.0, 5.55, 105.0)
        for own in ({}, changes)
    )
    check("force [N]", chosen["contact_force"], usual["contact_force"], within=within)
    # Beyond round-off: they are taken.
    assert np.abs(chosen["contact_force"] - usual["contact_force"]).max() > 1e-8
    assert np.max(chosen.watched) < 1e-9


@pytest.mark.parametrize("changes", [{}, {"motion": "all_bodies", "substeps": 2}])
def test_continued_run_is_the_uninterrupted_one(changes: dict[str, Any]) -> None:
    """The same operations on the same numbers, beside a pantograph of lumped masses."""
    line = en50318_line(4)
    data = paper.data(**changes)
    leading = train(70.0, 110.0, 150.0, data=data, static_force=150.0, raise_time=0.2)
    trailing = train(70.0, 110.0, 150.0, behind=(40.0,)).placements
    both = replace(leading, placements=leading.placements + trailing)
    whole, rest = continued(problem_of(line, WHOLE, train=both), mesh_of(line, 3), 300)
    assert len(rest.time) > 100 and rest["contact_force"].shape[1] == 2
    check_continued(whole, rest, 300, "contact_force", "head_height")
