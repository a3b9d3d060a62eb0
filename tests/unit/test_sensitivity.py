"""``catenary sensitivity``: parameters of a scene, the ranked table, and what is refused."""

from __future__ import annotations

import csv
import functools
import io
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import verb_runner
from measuring import check
from mpi4py import MPI
from scenes import load_scene, mesh_of, problem_of

import catenary
from catenary import InputError
from catenary.cases.run.at_rest import rest_of, sound_rest
from catenary.cases.scene.load import recorded_scene
from catenary.cases.scene.scene import resolved
from catenary.cases.studies.parameters.derivatives import (
    Sensitivity,
    as_text,
    change_by,
    sensitivity_of,
    table_of,
)
from catenary.cases.studies.parameters.parameters import ChangedScenes, Parameter
from catenary.postproc.evaluate.statistics import contact_statistics
from catenary.solver.statics.line_at_rest import line_at_rest
from catenary.solver.tangents.march import march_with_tangents
from catenary.solver.tangents.set_up import SetUp, differentiate, set_up_of

CASE = "en50318_2002"
# Six spans with two elements a gap, run through in 1152 steps; droppers slacken, contact lasts.
TINY = (
    "line.n_spans=6",
    "mesh.elements_per_gap=2",
    "train.start_m=65",
    "train.end_m=225",
    "train.raise_time_s=0.2",
    "numerics.dt_s=0.002",
    "evaluation.from_m=120",
    "evaluation.to_m=220",
)
KEYS = ["pantographs.reference.static_force_N", "line.contact_wire.tension_N"]


def scenes(*words: str, case: str = CASE) -> ChangedScenes:
    return ChangedScenes(load_scene(case, words))


def invoke(*words: str) -> Any:
    return verb_runner.invoke("sensitivity", CASE, *words)


@functools.cache
def tiny() -> Sensitivity:
    return sensitivity_of(load_scene(CASE, TINY), KEYS, MPI.COMM_SELF)


def test_statistics_change_as_runs_with_other_values() -> None:
    """Runs at both sides of a parameter, near enough for contacts and droppers to keep their
    steps."""
    found, other = tiny(), scenes(*TINY)
    (by_force,) = found.by_force
    for number, (key, by_uplift) in enumerate(zip(KEYS, found.by_uplift, strict=True)):
        parameter = other.parameter(key)
        step, both = 1e-6 * parameter.size, []
        for by in (step, -step):
            scene = other.changed(parameter, by)
            rest = line_at_rest(problem_of(scene), mesh_of(scene))
            seen = march_with_tangents(MPI.COMM_SELF, rest, [])
            force, place = seen.force[:, 0], seen.position[:, 0]
            stretch = rest.problem.evaluation
            both.append((contact_statistics("", place, force, force, seen.dt, stretch), seen))
        for name in ("mean", "std", "maximum", "minimum", "stat_max", "stat_min"):
            high, low = (getattr(statistics, name) for statistics, _ in both)
            # Round-off of 100 N, 1e-12 N after a march, over the step, and the step itself.
            by = getattr(by_force, name)[number]
            limit = 1e-12 * 100.0 / step + 1e-5 * abs(by)
            check(f"{name} by {key}", by, (high - low) / (2 * step), within=limit)
        high, low = (seen.uplift.max() for _, seen in both)
        limit = 1e-12 / step + 1e-5 * abs(by_uplift)
        check(f"uplift by {key}", by_uplift, (high - low) / (2 * step), within=limit)


def test_statistics_are_those_of_a_run_near_its_start() -> None:
    """The filter reaches some 0.1 s about a record: there the first one of a run counts."""
    near = ("train.raise_time_s=0.02", "evaluation.from_m=67", "evaluation.to_m=125")
    words = (*TINY, "train.end_m=127", *near)
    found = sensitivity_of(load_scene(CASE, words), KEYS[:1], MPI.COMM_SELF)
    (seen,) = found.statistics
    changes = {key: json.loads(value) for key, value in (word.split("=") for word in words)}
    run = catenary.run(catenary.load(CASE).replace(changes)).statistics.iloc[0]
    for name in ("mean", "std", "max", "min"):
        check(name, seen[name], run[f"{name}_N"], within=1e-9 * run["mean_N"])


def test_the_table_is_ranked_and_in_the_units_of_keys() -> None:
    found = tiny()
    table = table_of(found)
    ranks = [abs(row["std_change_by_percent_N"]) for row in table.rows]
    assert ranks == sorted(ranks, reverse=True) and len(ranks) == 2
    force = next(row for row in table.rows if row["parameter"] == KEYS[0])
    assert (force["unit"], force["value"], force["change"]) == ("N", 120.0, 1.0)
    assert force["mean_change_N"] == found.by_force[0].mean[0]
    assert force["std_change_by_percent_N"] == pytest.approx(1.2 * found.by_force[0].std[0])
    assert force["max_uplift_change_mm"] == pytest.approx(1e3 * found.by_uplift[0])
    tension = next(row for row in table.rows if row["parameter"] == KEYS[1])
    assert tension["change"] == 1000.0
    assert tension["std_change_N"] == pytest.approx(1000.0 * found.by_force[0].std[1])
    # A newton of static force is a newton of mean force, but for the base's spring of 50 N/m.
    assert force["mean_change_N"] == pytest.approx(1.0, abs=0.03)


@pytest.mark.parametrize("case", ["ac_simple", "re330_stitched"])  # a chain of masses, a mechanism
def test_lengths_of_droppers_share_the_sound_line(case: str) -> None:
    """Their derivatives are those by whole set-ups: equilibria solved anew agree within 1e-14 m,
    over steps of 5e-5 m."""
    own = scenes(case=case)
    rest = sound_rest(own.scene)
    now = set_up_of(MPI.COMM_SELF, rest)
    parameter = own.parameter("irregularities.dropper_lengths.8.4")

    def whole(by: float) -> SetUp:
        changed = own.changed(parameter, by)
        return set_up_of(MPI.COMM_SELF, rest_of(changed), len(now.drives))

    found = change_by(parameter, own, rest, now, MPI.COMM_SELF)
    expected = differentiate(whole, now, parameter.step, parameter.key)
    for name in ("rest", "links"):
        value = getattr(expected, name)
        check(name, getattr(found, name), value, within=2e-9 * np.abs(value).max())
    assert not found.matrices and not expected.matrices


def test_parameters_that_change_nothing_are_named() -> None:
    """The end of the march, beyond the evaluated stretch, is a parameter without effect."""
    found = sensitivity_of(load_scene(CASE, TINY), [KEYS[0], "train.end_m"], MPI.COMM_SELF)
    assert "\nWithout effect in the digits above: train.end_m.\n" in as_text(found)
    assert "Without effect" not in as_text(tiny())


def test_the_place_of_one_pantograph_moves_that_one_only() -> None:
    """By the second one's place the first one's statistics change through the wire alone."""
    two = ["line.n_spans=8", "train.start_m=130", "train.end_m=285", "mesh.elements_per_gap=2",
           "train.raise_time_s=0.1", "numerics.dt_s=0.002", "evaluation.from_m=180",
           "evaluation.to_m=220", "train.pantographs.1.name=reference",
           "train.pantographs.1.behind_m=60"]  # fmt: skip
    key = "train.pantographs.1.behind_m"
    other = scenes(*two)
    rest = line_at_rest(problem_of(other.scene), mesh_of(other.scene))
    now = set_up_of(MPI.COMM_SELF, rest)
    parameter = other.parameter(key)
    change = differentiate(
        lambda by: set_up_of(
            MPI.COMM_SELF,
            rest.under(problem_of(other.changed(parameter, by))),
            len(now.drives),
            now,
        ),
        now,
        parameter.step,
        key,
    )
    seen = march_with_tangents(MPI.COMM_SELF, rest, [change])
    assert np.allclose(seen.by_position[:, 0], [0.0, -1.0], rtol=0.0, atol=1e-9)
    found = sensitivity_of(load_scene(CASE, two), [key], MPI.COMM_SELF)
    assert found.names == ["leading", "trailing"]
    leading, trailing = found.by_force
    assert 0.0 < abs(leading.std[0]) and abs(trailing.std[0]) > 0.0


def test_what_is_printed_tells_how_often_contacts_and_droppers_switch() -> None:
    text = as_text(tiny())
    assert f"other links switched {tiny().link_switches} times" in text
    assert tiny().link_switches > 0
    assert text.startswith("pantograph: mean ")


def test_a_terminal_is_shown_how_far_it_is(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """Set-ups and tangents of two parameters are four, drawn at most every 0.1 s."""
    monkeypatch.setattr(sys, "stderr", stream := io.StringIO())
    monkeypatch.setattr(stream, "isatty", lambda: True, raising=False)
    with caplog.at_level("INFO", "catenary.progress"):
        sensitivity_of(load_scene(CASE, TINY), KEYS, MPI.COMM_SELF, shows=True)
    shown = stream.getvalue()
    assert "set-ups and tangents   0% |" in shown and "0 of 4, left ?" in shown
    assert shown.endswith(" \r")


def test_entries_lists_and_forces_by_speed_are_parameters() -> None:
    line = scenes(case="ac_simple")
    sag = line.parameter("line.dropper.pre_sag_mm")
    one = line.parameter("line.dropper.pre_sag_mm.3")
    before = line.scene.line.dropper
    assert before is not None and before.pre_sag_mm is not None
    assert sag.values == tuple(before.pre_sag_mm) and one.values == (before.pre_sag_mm[3],)
    for parameter, moved in ((sag, range(9)), (one, [3])):
        after = line.changed(parameter, 0.5).line.dropper
        assert after is not None and after.pre_sag_mm is not None
        changed = np.array(after.pre_sag_mm) - np.array(before.pre_sag_mm)
        assert np.flatnonzero(changed).tolist() == list(moved)
        assert changed[list(moved)] == pytest.approx(0.5)
    force = line.parameter("pantographs.three_masses.static_force_N")
    changed_force = problem_of(line.changed(force, 2.0)).train.placements[0].static_force
    assert changed_force == pytest.approx(force.values[0] + 2.0)
    assert (sag.unit, sag.change, sag.cells["shown"]) == ("mm", 1.0, "9 values")


@pytest.mark.parametrize(
    "key",
    [*KEYS, "train.speed_km_h", "irregularities.dropper_lengths.2.3"],
)
def test_a_changed_scene_is_as_its_tables_are_read_and_the_scene_stays(key: str) -> None:
    own = scenes(*TINY)
    parameter, before = own.parameter(key), resolved(own.scene)
    found = resolved(own.changed(parameter, 0.5))
    assert found == resolved(recorded_scene(found, Path("changed")))
    assert found != before == resolved(own.scene)


def test_a_change_that_a_scene_refuses_is_told() -> None:
    own = scenes(*TINY)
    with pytest.raises(InputError, match=r"train.speed_km_h"):
        own.changed(own.parameter("train.speed_km_h"), -1000.0)
    # What one table says of another.
    with pytest.raises(InputError, match=r"raise_time_s"):
        own.changed(own.parameter("train.raise_time_s"), 10.0)


def test_a_dropper_has_a_length() -> None:
    key = "irregularities.dropper_lengths.3.2"
    line = scenes(*TINY)
    parameter = line.parameter(key)
    assert (parameter.values, parameter.unit, parameter.change) == ((0.0,), "mm", 1.0)
    lengths = line.changed(parameter, 0.5).irregularities.dropper_lengths
    assert lengths is not None and lengths.by_dropper == [[3.0, 2.0, 0.5]]
    evaluated = [one.key for one in line.droppers()]
    # Spans of 60 m, evaluated from 120 to 220 m; nine droppers from 5 to 55 m of each.
    assert len(evaluated) == 9 + 6
    assert evaluated[0].endswith(".3.1") and evaluated[-1].endswith(".4.6")


def test_a_support_has_a_height() -> None:
    """Droppers are cut for it: the wire at rest is as high there, and as before at others."""
    line = scenes(*TINY)
    (parameter,) = line.heights_at([2])
    assert (parameter.values, parameter.unit, parameter.change) == ((0.0,), "mm", 1.0)
    lifted = line.changed(parameter, 3.0)
    heights = lifted.irregularities.contact_wire_height
    assert heights is not None and heights.by_place is not None
    assert [own for own in heights.by_place if own[1]] == [[120.0, pytest.approx(3e-3)]]
    again = ChangedScenes(lifted)
    assert again.parameter(parameter.key).values == pytest.approx((3.0,))
    rests = [line_at_rest(problem_of(scene), mesh_of(scene)) for scene in (line.scene, lifted)]
    places, (before, after) = (
        rests[0].model.contact_x,
        (set_up_of(MPI.COMM_SELF, rest, 1).rest[:, 0] for rest in rests),
    )
    at = [int(np.argmin(np.abs(places - 60.0 * number))) for number in range(1, 5)]
    # The spline is exact at supports; stiff wires between droppers round its corners.
    assert (after - before)[at] == pytest.approx([0.0, 3e-3, 0.0, 0.0], abs=1e-4)
    with pytest.raises(InputError, match="names no support: the line has supports from 0 to 6"):
        line.heights_at([7])
    surveyed = scenes(*TINY, "irregularities.contact_wire_height.by_place=[[100,0.01],[130,0.0]]")
    with pytest.raises(InputError, match="by_place has other places than all supports"):
        surveyed.heights_at([2])


def test_a_longer_dropper_changes_the_rest_as_elasticity_says() -> None:
    """The wire at a dropper too long by e sinks by e less what its neighbours take over."""
    line = scenes(*TINY)
    parameter = line.parameter("irregularities.dropper_lengths.3.5")
    rests = []
    for by in (0.05, -0.05):
        rest = line_at_rest(problem_of(line.changed(parameter, by)), mesh_of(line.scene))
        rests.append(set_up_of(MPI.COMM_SELF, rest, 1))
    sinks = (rests[0].rest[:, 0] - rests[1].rest[:, 0]) / 1e-4  # of 0.1 mm
    lowest = int(np.argmin(sinks))
    nodes = line_at_rest(problem_of(line.scene), mesh_of(line.scene)).model.contact_x
    assert nodes[lowest] == pytest.approx(150.0) and -1.0 < sinks[lowest] < -0.1
    found = sensitivity_of(load_scene(CASE, TINY), [parameter.key], MPI.COMM_SELF)
    assert found.by_force[0].std[0] != 0.0
    (row,) = table_of(found).rows
    assert row["std_change_by_percent_N"] is None


def test_the_usual_parameters_are_those_of_the_train_and_the_line() -> None:
    usual = {parameter.key for parameter in scenes().usual()}
    expected = {
        "pantographs.reference.static_force_N", "pantographs.reference.masses_kg.1",
        "contact.stiffness_N_per_m", "line.contact_wire.tension_N", "line.damping.alpha_s",
        "line.dropper.stiffness_N_per_m", "line.steady_arm.stiffness_N_per_m",
    }  # fmt: skip
    assert expected <= usual
    assert "line.dropper.mass_kg_per_m" not in usual  # which is zero
    assert not any(key.startswith(("numerics.", "mesh.", "train.")) for key in usual)
    assert "line.stitch_wire.tension_N" in {
        parameter.key for parameter in scenes(case="re330_stitched").usual()
    }


def test_a_step_follows_from_the_size_of_a_value() -> None:
    assert Parameter("line.contact_wire.tension_N", (2e4,)).step == pytest.approx(6.0)
    assert Parameter("line.dropper.pre_sag_mm", (0.0, 0.0)).step == pytest.approx(0.05)
    assert Parameter("defects.0.at_m", (5000.0,)).step == pytest.approx(1e-4)
    assert Parameter("line.damping.beta_per_s", (0.0,)).change == 1.0
    # A conductor rail has some 100 N, of which a kilonewton is no small change.
    assert Parameter("line.contact_wire.tension_N", (100.0,)).change == 1.0


@pytest.mark.parametrize(
    ("key", "told"),
    [
        ("line.contact_wire.tensoin_N", "did you mean line.contact_wire.tension_N"),
        ("line.topology", "line.topology has no number in this scene"),
        ("pantographs.reference.masses_kg.7", "the list there has entries from 0 to 1"),
        ("pantographs.refernce.masses_kg.0", "; its pantographs are reference"),
        ("pantographs", "; its pantographs are reference"),
        ("evaluation.to_m", "evaluation.to_m does not act on the march, but on its evaluation"),
        ("line.curve.radius_m", "has no number in this scene"),
        ("line.n_spans", "is a whole number, by which a march has no derivative"),
        ("irregularities.dropper_lengths.3.44", "and 9 droppers in this one"),
        ("irregularities.dropper_lengths.99.4", "names no dropper: the line has 22 spans"),
        ("contact.damping_N_s_per_m", "is at a bound of what is allowed, where a march has no"),
    ],
)
def test_a_wrong_parameter_is_told_in_one_sentence(key: str, told: str) -> None:
    result = invoke("-p", key)
    assert result.exit_code == 2
    assert told in result.output and result.output.count("\n") == 1


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (
            ["numerics.integrator=hht", "numerics.spectral_radius=0.8"],
            'numerics.integrator other than "newmark"',
        ),
        (["numerics.coupling=explicit"], 'numerics.coupling other than "implicit"'),
        (["numerics.dt_s=0.025"], "too slowly for the 20 Hz filter"),
    ],
)
def test_a_march_without_derivatives_is_told(words: list[str], told: str) -> None:
    result = invoke("-p", KEYS[0], "--set", *TINY, *words, "case.accept_unusual=true")
    assert result.exit_code == 2 and told in result.output


def test_a_ready_pantograph_keeps_its_numbers() -> None:
    ready = scenes(
        *TINY, "pantographs.reference.model=dsa380", "pantographs.reference.masses_kg=",
        "pantographs.reference.stiffnesses_N_per_m=", "pantographs.reference.dampings_N_s_per_m=",
    )  # fmt: skip
    with pytest.raises(InputError, match=r"pantographs\.reference is the ready dsa380"):
        ready.parameter("pantographs.reference.masses_kg.0")
    assert not any(one.key.startswith("pantographs") for one in ready.usual())


def test_the_geometry_of_the_mesh_is_no_parameter() -> None:
    for key in ("line.dropper.positions_m.2", "numerics.dt_s", "line.n_spans"):
        with pytest.raises(InputError, match="by which a march has no derivative"):
            sensitivity_of(load_scene(CASE, TINY), [key], MPI.COMM_SELF)


def test_proportional_damping_needs_no_term_of_its_own() -> None:
    """With the mass of the contact wire its mass and the droppers' stiffness across their tension
    change, in part at the same nodes: damping by 0.02 s and 0.1 1/s is found in both at once."""
    damping = ("line.damping.alpha_s=0.02", "line.damping.beta_per_s=0.1")
    own = scenes("line.n_spans=20", "mesh.elements_per_gap=2", *damping, case="ambrosio2012")
    at_rest, parameter = sound_rest(own.scene), own.parameter("line.contact_wire.mass_kg_per_m")
    now = set_up_of(MPI.COMM_SELF, at_rest)
    change = change_by(parameter, own, at_rest, now, MPI.COMM_SELF)
    by = [one.weights for one in change.matrices]
    # Differences of set-ups are off by 1e-10 of themselves.
    assert by == [(1.0, pytest.approx(0.02, rel=1e-9), 0.0), (0.0, pytest.approx(0.1, rel=1e-9), 1)]


def test_the_verb_writes_its_table_once(tmp_path: Path) -> None:
    words = ["-p", KEYS[0], "-o", str(tmp_path), "--set", *TINY]
    first = invoke(*words)
    assert first.exit_code == 0, first.output
    (row,) = csv.DictReader((tmp_path / "sensitivity.csv").read_text().splitlines())
    assert row["parameter"] == KEYS[0]
    expected = tiny().by_force[0].std[0]
    assert float(row["std_change_N"]) == pytest.approx(expected, rel=1e-12)
    again = invoke(*words)
    assert again.exit_code == 2 and "is there already" in again.output
    assert invoke(*words, "--force").exit_code == 0


def test_what_moves_the_train_along_the_track_is_doubted() -> None:
    """A march of n steps at v ends a step farther if it runs by v/n faster, or begins there."""
    keys = ["train.speed_km_h", "train.start_m", KEYS[1]]
    found = sensitivity_of(load_scene(CASE, TINY), keys, MPI.COMM_SELF)
    text = as_text(found)
    # 1152 steps of 2 ms at 250 km/h: 0.22 km/h and 0.14 m.
    assert "\ntrain.speed_km_h already moves some of these by 0.2 km/h: for larger" in text
    assert "\ntrain.start_m already moves some of these by 0.1 m: for larger" in text
    assert "moves some" not in as_text(tiny())
