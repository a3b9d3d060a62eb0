"""Optima and tolerances of lines that are run, against brute force; figures against a run's."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
import pytest
from measuring import check
from scenes import TINY, find_case, read_draft

import catenary
from catenary.cases.scene.load import Draft
from catenary.cases.scene.turned import BACKWARD
from catenary.cases.studies.optimise import study as optimising
from catenary.cases.studies.optimise.study import AS_IS, FINER_MESH, SHORTER_STEP, UNSEEN, change
from catenary.cases.studies.optimise.task import OptimiseTask
from catenary.cases.studies.scene_sets import (
    BROKE,
    Evaluation,
    SceneSet,
    SetTable,
    evaluate,
    members_of,
    workers,
)
from catenary.cases.studies.task_files import read_task
from catenary.cases.studies.tolerance import study as tolerating
from catenary.cases.studies.tolerance.errors import ToleranceTask

TENSION = "line.contact_wire.tension_N"
SUM = ("pantographs", "histograms", "droppers", "acceptance", "not_judged", "passed", "remarks")


def tiny(**more: Any) -> Draft:
    values = TINY | {"output.field_every_s": 0.0} | more
    return read_draft("en50318_2002").assigned((k, v, "in the test") for k, v in values.items())


def test_figures_are_those_of_a_run() -> None:
    slack = tiny(**{"line.dropper.pre_sag_mid_mm": -100.0}).scene()
    found, broken = evaluate([tiny().scene(), slack])
    summary = catenary.run(tiny().table()).summary
    expected = {name: summary[name] for name in SUM}
    expected["supports"] = {"max_uplift_mm": summary["supports"]["max_uplift_mm"]}
    # The march steps what waves have reached: forces and heights are those of the whole line but
    # for round-off, some 1e-12 of each.
    found, expected = (pd.json_normalize(one).iloc[0] for one in (found, expected))
    pd.testing.assert_series_equal(
        found.sort_index(), expected.sort_index(), rtol=1e-10, atol=1e-10
    )
    assert set(broken) == {BROKE} and "slack at rest" in broken[BROKE]


@pytest.mark.study
@pytest.mark.process
def test_several_processes_find_the_same() -> None:
    scenes = [tiny(**{"train.speed_km_h": speed}).scene() for speed in (200.0, 230.0)]
    with workers(2) as pool:
        shared = evaluate(scenes, pool)
    for one, other in zip(shared, evaluate(scenes), strict=True):
        # Scenes that march side by side differ from those that march alone by round-off.
        own, theirs = (summary["pantographs"][0]["std_N"] for summary in (one, other))
        assert own == pytest.approx(theirs, rel=0.0, abs=1e-8)


def test_both_directions_of_a_lopsided_line_differ_and_turn_into_each_other() -> None:
    """A train that runs forward on a line and one that runs backward on its mirror image see the
    same line: the same force, to round-off that 460 steps carry on."""
    sag = [0.0, 20.0, 25.0, 30.0, 20.0, 10.0, 5.0, 0.0, 0.0]
    key = "line.dropper.pre_sag_mm"
    here, there = tiny(**{key: sag}), tiny(**{key: sag[::-1]})
    forward, backward = members_of(SetTable())
    scenes = [SceneSet(draft, [forward, backward]) for draft in (here, there)]
    own, other_way, mirrored = (
        one["pantographs"][0]["std_N"]
        for one in evaluate(
            [scenes[0].scene(forward), scenes[0].scene(backward), scenes[1].scene(backward)]
        )
    )
    check("std forward and backward on the mirror image [N]", mirrored, own, within=1e-6)
    assert abs(other_way - own) > 0.1


@pytest.mark.study
def test_a_search_finds_what_brute_force_finds() -> None:
    draft = tiny()
    low, high = 0.0, 6000.0
    scenes = SceneSet(draft, members_of(SetTable(directions=["forward"])))
    (member,) = scenes.members
    tensions = 20e3 + np.linspace(low, high, 9)
    summaries = Evaluation().of([(scenes, member, {TENSION: float(t)}) for t in tensions])
    brute = min(one["pantographs"][0]["std_N"] for one in summaries)
    task = read_task(
        {
            "set": {"directions": ["forward"]},
            "variables": [{"key": TENSION, "change": [low, high]}],
            "checks": {"n_seeds": 0},
        },
        OptimiseTask,
    )
    (found,) = optimising.optimise(optimising.make_plan(draft, task))
    print(f"brute force {brute:.3f} N of 9 runs, search {found.found.value:.3f} N")
    # At least as good as the best of nine tensions, but for the precision of 1e-3 at which a
    # search ends.
    assert found.found.value <= brute * 1.002
    assert found.found.value < 0.95 * found.shipped.value


@pytest.mark.study
def test_tolerance_of_a_run_is_that_of_brute_force() -> None:
    """Each sample's critical level by its own bisection, against the one of all samples."""
    draft = tiny()
    nominal = evaluate([draft.scene()])[0]["pantographs"][0]["std_N"]
    errors = {"name": "tension", "kind": "tension", "level": 2.0, "most": 16.0}
    bound = {"statistic": "std_N", "at_most": 1.02 * nominal}
    samples = {"number": 6, "probability": 0.55, "confidence": 0.8, "resolution": 0.13}
    samples["worst_case"] = False
    tables = {"errors": [errors], "criteria": [bound], "samples": samples}
    task = read_task(tables | {"set": {"directions": ["forward"]}}, ToleranceTask)
    plan = tolerating.make_plan(draft, task)
    (found,) = tolerating.find_tolerances(plan)
    drawn = plan.groups[0].random(np.random.default_rng([1, 0]), 6)

    def kept(level: float) -> int:
        values = [plan.groups[0].values(level * own) for own in drawn]
        scenes = [draft.assigned((k, v, "") for k, v in own.items()).scene() for own in values]
        return sum(one["pantographs"][0]["std_N"] <= 1.02 * nominal for one in evaluate(scenes))

    # Of six, one may fail: no more do with a probability of 0.16 where 55 % of the lines keep it.
    # Halves of 16 %: 2 % is the resolution.
    assert 0.0 < found.level < 16.0
    assert kept(found.level) == found.kept >= 5
    assert kept(found.level + 2.0) < 5


@pytest.mark.study
@pytest.mark.timeout(3600)
def test_dropper_lengths_calm_the_benchmark_at_320_km_h() -> None:
    """By dropper lengths alone a user's descent took 60.4 to 47.4 N in both directions."""
    draft = read_draft("ac_simple").assigned([("train.speed_km_h", 320.0, "in the test")])
    tables = {
        "variables": [{"key": "line.dropper.pre_sag_mm", "change": [-40.0, 40.0], "round_to": 1.0}],
        "constraints": [{"statistic": "min_N", "at_least": 0.0}],
    }
    plan = optimising.make_plan(draft, read_task(tables, OptimiseTask))
    (found,) = optimising.optimise(plan)
    # The benchmark's own figure, as the case has it.
    check("std as shipped [N]", found.shipped.value, 60.43, within=0.02)
    assert found.found.value < 47.4
    for name in (AS_IS, FINER_MESH, SHORTER_STEP, UNSEEN):
        own = [row for row in found.rows if row.check == name]
        assert {row.direction for row in own} == {"forward", BACKWARD}
        by = [change(row, "std_N") for row in own]
        print(f"{name}: {100 * min(by):+.1f} to {100 * max(by):+.1f} %")
        assert max(by) < -0.20
        assert min(row.optimum["min_N"] for row in own) > 34.0
    assert len(found.remarks) == 1 and found.remarks[0].startswith("max_uplift_mm gets worse")


def over_all_speeds(task: str) -> tuple[OptimiseTask, optimising.Optimum]:
    """The optimum of a shipped task from 250 to 330 km/h, one and two pantographs."""
    forces = [[250, 132.4], [275, 145.6], [300, 160.29], [320, 173.35], [330, 180.1]]
    key = "pantographs.three_masses.static_force_by_speed"
    found = read_task(find_case("ac_simple").parent / task, OptimiseTask)
    plan = optimising.make_plan(read_draft("ac_simple").assigned([(key, forces, "")]), found)
    (optimum,) = optimising.optimise(plan)
    return found, optimum


@pytest.mark.study
@pytest.mark.timeout(3600)
def test_an_evolution_calms_the_benchmark_where_it_is_worst_and_no_speed_gets_worse() -> None:
    """Dropper lengths alone: a fifth less at 320 km/h in some 330 runs."""
    task, found = over_all_speeds("droppers_by_speed.toml")
    assert found.n_runs <= 350 and not found.found.violation
    for name in (AS_IS, FINER_MESH, SHORTER_STEP, UNSEEN):
        for speed in task.set.speeds_km_h or []:
            own = [row for row in found.rows if row.check == name and f" {speed:g} " in row.scene]
            before, after = (
                max(figures["std_N"] for figures in design)
                for design in ([row.shipped for row in own], [row.optimum for row in own])
            )
            print(f"{name}, {speed:g} km/h: {before:.1f} to {after:.1f} N")
            # The search ended at 320 km/h with -22 %, on lines with errors with -20 %.
            assert after < (0.81 if speed == 320.0 else 1.0) * before


@pytest.mark.study
@pytest.mark.timeout(3600)
def test_lengths_and_tension_calm_every_pantograph_at_every_speed() -> None:
    """The search ended with -41 % at 320 km/h and -1.5 % or more everywhere, mesh x 2 included."""
    _, found = over_all_speeds("droppers_and_tension.toml")
    assert found.n_runs <= 400 and not found.found.violation
    assert len(found.rows) == 120
    assert all(change(row, "std_N") < 0.0 for row in found.rows)
    at_320 = [row for row in found.rows if " 320 " in row.scene]
    shipped = max(row.shipped["std_N"] for row in at_320)
    assert max(row.optimum["std_N"] for row in at_320) < 0.65 * shipped
