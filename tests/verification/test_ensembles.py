"""Scenes that share a line march side by side, and give what their own runs give.

A lane takes the sums of a scene's own kernels in another order, which round-off tells apart:
1e-10 N of forces of some hundred. Summaries are compared within 1e-8.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pytest
from scenes import Scene, mesh_of, problem_of, read_draft

import catenary
from catenary import InputError
from catenary.base.process import alone
from catenary.cases.run.at_rest import sound_rest
from catenary.cases.scene.input.case_files import REMOVED
from catenary.cases.studies import ensemble as scenes_on_lines
from catenary.cases.studies.ensemble import Marched, Marches
from catenary.cases.studies.scene_sets import pieces_of
from catenary.solver import ensemble
from catenary.solver.ensemble import SceneHistory, SharedLine, march_side_by_side
from catenary.solver.kernels import native
from catenary.solver.statics.line_at_rest import line_at_rest
from catenary.solver.time_loop.march import March

# Of the summary of an own run what studies read.
READ = ("pantographs", "histograms", "droppers", "acceptance", "not_judged", "passed", "remarks")


def scenes_of(case: str, changes: Sequence[Mapping[str, Any]]) -> list[Scene]:
    draft = read_draft(case).shortened()
    return [
        draft.assigned([(key, value, "") for key, value in own.items()]).scene() for own in changes
    ]


def marched(scenes: Sequence[Scene]) -> tuple[list[Marched], bool]:
    """How scenes ended, and whether they marched side by side."""
    own = Marches()
    try:
        found = sorted(own.of(scenes))
        line = own._line
        return found, line is not None and line.shared is not None
    finally:
        own.destroy()


def own_run(case: str, change: Mapping[str, Any]) -> dict[str, Any]:
    tables: dict[str, Any] = {}
    for key, value in change.items():
        *path, name = key.split(".")
        here = tables
        for part in path:
            here = here.setdefault(part, {})
        here[name] = value
    summary = catenary.run(catenary.load(case, short=True).replace(**tables)).summary
    uplift = summary["supports"]["max_uplift_mm"]
    return {name: summary[name] for name in READ} | {"supports": {"max_uplift_mm": uplift}}


def watched(one: Marched) -> bool:
    return one.results is not None and bool(one.results.attributes.get("watched"))


def differences(one: Any, other: Any, path: str = "") -> list[str]:
    if isinstance(one, dict) and isinstance(other, dict):
        names = set(one) | set(other)
        return [
            text
            for name in sorted(names)
            for text in differences(one.get(name), other.get(name), f"{path}/{name}")
        ]
    if isinstance(one, list) and isinstance(other, list) and len(one) == len(other):
        pairs = enumerate(zip(one, other, strict=True))
        return [t for i, (a, b) in pairs for t in differences(a, b, f"{path}/{i}")]
    if isinstance(one, float) and isinstance(other, float):
        return [] if abs(one - other) < 1e-8 else [f"{path}: {one} {other}"]
    return [] if one == other else [f"{path}: {one!r} {other!r}"]


# A line of each kind of stations, and trains of one and of two pantographs.
@pytest.mark.parametrize(
    "case",
    [
        "en50318_2002",
        "re330_stitched",
        "overlap",
        *(
            pytest.param(case, marks=pytest.mark.study)
            for case in ("dc_twin", "shinkansen_compound")
        ),
    ],
)
def test_scenes_side_by_side_give_what_their_own_runs_give(case: str) -> None:
    speed = read_draft(case).shortened().scene().train.speed_km_h
    changes = [{"train.speed_km_h": share * speed} for share in (1.0, 0.98, 0.96)]
    found, together = marched(scenes_of(case, changes))
    assert together and [one.outcome for one in found] == ["done"] * 3
    assert differences(found[1].summary(), own_run(case, changes[1])) == []


def test_what_was_marched_before_changes_no_digit() -> None:
    """As processes share a sweep in any order: a lone scene marches by itself, and the line at rest
    is that of its errors alone."""
    name = "irregularities.dropper_lengths"
    errors = [{f"{name}.standard_deviation_mm": d, f"{name}.seed": 3} for d in (1.0, 5.0)]
    changes = [{"train.speed_km_h": v} for v in (250.0, 240.0, 230.0)]
    for others in changes, [one | changes[0] for one in errors]:
        scenes = scenes_of("en50318_2002", others)
        marches = Marches()
        try:
            list(marches.of([*scenes[1:], *scenes[1:]]))
            (after,) = marches.of(scenes[:1])
        finally:
            marches.destroy()
        (alone,), together = marched(scenes[:1])
        assert not together and after.summary() == alone.summary()


@pytest.mark.parametrize("n", [2, 3])
def test_no_process_gets_one_scene_of_several_on_a_line(n: int) -> None:
    """It would march alone there, and beside the others without processes."""
    speeds = [{"train.speed_km_h": 200.0 + number} for number in range(5)]
    tension = "line.contact_wire.tension_N"
    lines = [{tension: 19_000.0 + number} for number in range(3)]
    scenes = scenes_of("en50318_2002", [*speeds, *lines, {**speeds[0], tension: 21e3}])
    pieces = pieces_of([scenes[i] for i in (0, 5, 1, 6, 2, 7, 3, 8, 4)], n)
    assert sorted(number for piece in pieces for number in piece) == list(range(9))
    assert all(sum(number % 2 == 0 for number in piece) != 1 for piece in pieces)
    assert len(pieces) <= n


def test_lanes_are_filled_again_with_trains_of_other_lengths() -> None:
    """More scenes than lanes, of which some end sooner, with one and two pantographs."""
    pair = [{"name": "moving_frame"}, {"name": "moving_frame", "behind_m": 60.0}]
    name = read_draft("en50318_2002").scene().train.pantographs[0].name
    pair = [{**place, "name": name} for place in pair]
    changes: list[dict[str, Any]] = [{"train.speed_km_h": 200.0 + 10.0 * k} for k in range(9)]
    changes.insert(2, {"train.speed_km_h": 250.0, "train.pantographs": pair})
    assert len(changes) > 8  # the most lanes
    found, together = marched(scenes_of("en50318_2002", changes))
    assert together
    for number in (2, 6):
        assert differences(found[number].summary(), own_run("en50318_2002", changes[number])) == []


def test_any_number_of_lanes_gives_the_same_motions(monkeypatch: pytest.MonkeyPatch) -> None:
    """To the last bit: a processor's choice of lanes changes no table."""
    at_rest = sound_rest(scenes_of("en50318_2002", [{}])[0])
    with March(alone(), *at_rest) as march:
        passes = march.in_loop()[0].interaction.line.passes
        assert passes is not None
        numbers = passes.scenes_at_once
    found = []
    for n in numbers:
        monkeypatch.setattr(ensemble, "_quickest", lambda *_, n=n: n)
        shared = SharedLine(at_rest, (-1e9, 1e9), n)
        assert len(shared.lanes) == n
        [own] = march_side_by_side(shared, [(0, at_rest)])
        assert isinstance(own, SceneHistory)
        found.append((own.contact_force, own.uplift, own.dropper_force))
        shared.destroy()
    for other in found[1:]:
        for one, two in zip(found[0], other, strict=True):
            np.testing.assert_array_equal(one, two)


@pytest.mark.parametrize(
    "case", ["en50318_2002", pytest.param("ambrosio2012", marks=pytest.mark.study)]
)
def test_lines_with_other_errors_of_dropper_lengths_share_matrices(
    case: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of droppers with a stiffness of their own, and with EA over their length."""
    key = "irregularities.dropper_lengths"
    monkeypatch.setattr(scenes_on_lines, "_alone", None)
    changes = [
        {f"{key}.standard_deviation_mm": 2.0, f"{key}.seed": seed, "train.speed_km_h": 240.0 + seed}
        for seed in range(1, 6)
    ]
    found, together = marched(scenes_of(case, changes))
    assert together
    deviations = [one.summary()["pantographs"][0]["std_N"] for one in found]
    assert len(set(deviations)) == len(changes)
    for number in (0, 4):
        assert differences(found[number].summary(), own_run(case, changes[number])) == []


@pytest.mark.study
@pytest.mark.parametrize("stops", [{}, {"line.steady_arm.uplift_stop_m": 0.03}])
def test_lines_with_other_slack_droppers_at_rest_share_lanes(
    stops: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Own runs hold a slack dropper open, lanes taut with a compensation from the start. Stops of
    all are where they were installed."""
    key = "irregularities.dropper_lengths"
    changes = [
        {f"{key}.standard_deviation_mm": 12.0, f"{key}.seed": seed} | stops for seed in range(1, 5)
    ]
    scenes = scenes_of("en50318_2002", changes)
    slack = [
        np.flatnonzero(line_at_rest(problem_of(one), mesh_of(one)).model.dropper_gap).tolist()
        for one in scenes
    ]
    assert sum(map(bool, slack)) > 1 and len(set(map(tuple, slack))) > 2
    monkeypatch.setattr(scenes_on_lines, "_alone", None)
    found, together = marched(scenes)
    assert together
    for number, own in enumerate(slack):
        if own:
            summary = found[number].summary()
            assert differences(summary, own_run("en50318_2002", changes[number])) == []


@pytest.mark.study
def test_scenes_with_loads_march_one_by_one() -> None:
    speed = read_draft("windy_viaduct").shortened().scene().train.speed_km_h
    changes = [{"train.speed_km_h": speed}, {"train.speed_km_h": 0.98 * speed}]
    found, together = marched(scenes_of("windy_viaduct", changes))
    assert not together
    assert differences(found[1].summary(), own_run("windy_viaduct", changes[1])) == []


def test_droppers_with_a_curve_march_one_by_one() -> None:
    curve = [[0.0, 0.0], [1e-4, 20.0], [1e-3, 400.0]]
    changes: list[dict[str, Any]] = [
        {
            "line.dropper.curve": curve,
            "line.dropper.stiffness_N_per_m": REMOVED,
            "train.speed_km_h": speed,
        }
        for speed in (240.0, 250.0)
    ]
    found, together = marched(scenes_of("en50318_2002", changes))
    assert not together and [one.outcome for one in found] == ["done"] * 2


def test_pantographs_that_python_steps_march_one_by_one(monkeypatch: pytest.MonkeyPatch) -> None:
    """An error in one of them would end a step of all lanes."""
    refused: list[str] = []

    def refuse(model: object) -> None:
        refused.append(type(model).__name__)
        raise InputError("a pantograph has all its bodies in the time loop, which Python steps")

    monkeypatch.setattr(ensemble, "stepped_by_kernels", refuse)
    changes = [{"train.speed_km_h": 240.0}, {"train.speed_km_h": 250.0}]
    found, _ = marched(scenes_of("en50318_2002", changes))
    assert len(refused) == 2 and [one.outcome for one in found] == ["done"] * 2
    assert all(watched(one) for one in found)


@pytest.mark.study
def test_scenes_march_alike_on_all_processors() -> None:
    """One by one where no kernels take several of them, side by side on all others."""
    changes = [{"train.speed_km_h": 240.0}, {"train.speed_km_h": 250.0}]
    best, *others = reversed(native.targets())
    if not others:
        pytest.skip("this processor has no other kernels")
    expected, together = marched(scenes_of("en50318_2002", changes))
    assert together
    try:
        for target in others:
            assert native.set_target(target)
            found, together = marched(scenes_of("en50318_2002", changes))
            assert together == (target != "baseline")
            for one, other in zip(found, expected, strict=True):
                assert differences(one.summary(), other.summary()) == []
    finally:
        native.set_target(best)


def test_a_scene_that_breaks_stops_no_other() -> None:
    """A kinematic contact breaks where its force would pull: its own march tells why, and those in
    other lanes go on."""
    damped = {"numerics.newmark_gamma": 0.55, "numerics.newmark_beta": 0.28}
    kinematic = {"contact.law": "kinematic", "contact.stiffness_N_per_m": REMOVED}
    changes: list[dict[str, Any]] = [
        {**damped, "train.speed_km_h": 240.0},
        {**damped, **kinematic, "train.speed_km_h": 330.0},
        {**damped, "train.speed_km_h": 250.0},
    ]
    found, together = marched(scenes_of("en50318_2002", changes))
    assert together
    assert [one.outcome == "done" for one in found] == [True, False, True]
    assert "would have to pull" in found[1].outcome
    assert differences(found[2].summary(), own_run("en50318_2002", changes[2])) == []


def test_unusual_scenes_are_marched_again_under_a_watch(monkeypatch: pytest.MonkeyPatch) -> None:
    changes = [{"train.speed_km_h": 240.0}, {"train.speed_km_h": 250.0}]
    usual, _ = marched(scenes_of("en50318_2002", changes))
    uplifts = sorted(one.summary()["supports"]["max_uplift_mm"] for one in usual)
    monkeypatch.setattr(scenes_on_lines, "_UPLIFT", 0.5e-3 * sum(uplifts))
    found, together = marched(scenes_of("en50318_2002", changes))
    assert together
    assert sorted(watched(one) for one in found) == [False, True]
    for one, other in zip(usual, found, strict=True):
        assert differences(one.summary(), other.summary()) == []
