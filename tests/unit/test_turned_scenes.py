"""A train that runs the other way: the mirror image of a line hangs, and is run on, as it must."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest
from scenes import Scene, line_of, load_scene, resolved

from catenary import InputError
from catenary.cases.run.at_rest import static_table
from catenary.cases.scene.keys.keys import known_keys
from catenary.cases.scene.turned import has_mirrored_line, turned

# Spans of two lengths in an order of their own, droppers that are no mirror image of themselves.
ONE_SIDED = (
    "line.n_spans=5",
    "line.span_m=[55.0, 50.0, 55.0, 55.0, 50.0]",
    "line.dropper.positions_m=",
    "line.dropper.pre_sag_mm=",
    "line.dropper.patterns=[{span_m = 50.0, positions_m = [5.0, 25.0, 44.0], "
    "pre_sag_mm = [0.0, 35.0, 0.0]}, {span_m = 55.0, positions_m = [4.5, 16.0, 30.0, 50.5], "
    "pre_sag_mm = [0.0, 30.0, 41.0, 5.0]}]",
    'line.fittings=[{kind = "splice", at_m = 120.0, mass_kg = 2.0}]',
    'line.ends.start.kind="absorbing_layer"',
    "line.ends.start.spans=1",
    "irregularities.dropper_lengths.standard_deviation_mm=4",
    "irregularities.dropper_lengths.by_dropper=[[2, 1, 3.0]]",
    'defects=[{type = "missing_dropper", span = 3, dropper = 2}, '
    '{type = "kink", at_m = 90.0, angle_deg = 0.1}]',
    "mesh.elements_per_gap=2",
    "train.start_m=60",
    "evaluation.from_m=120",
    "evaluation.to_m=200",
)


def scene_of(*assignments: str) -> Scene:
    return load_scene("ac_simple", assignments)


def plain(scene: Scene) -> dict[str, Any]:
    raw = resolved(scene)
    return {key: value for key, value in raw.items() if key not in ("output", "test")}


# Last words of keys that say a place along the track.
PLACE = re.compile(
    r"(at|from|to|course|stretches|\w*positions|\w*points)_m|by_place|by_dropper|span"
)


def test_all_places_along_the_track_are_turned_or_refused() -> None:
    """A table with a place, and no line here, is one that trains backward would meet as it was."""
    outside = ("case", "train", "pantographs", "evaluation", "output", "test", "numerics")
    found = {
        key.rpartition(".")[0]
        for key in known_keys(Scene)
        if key.partition(".")[0] not in outside and PLACE.fullmatch(key.rpartition(".")[2])
    }
    dropper, hung = "line.dropper", "line.auxiliary_wire.dropper"
    turned_by_name = {"line", "line.curve", "line.fittings.*", "line.tunnels.*", "wind.stretches.*"}
    turned_by_name |= {one for own in (dropper, hung) for one in (own, f"{own}.patterns.*")}
    turned_by_name |= {
        f"irregularities.{name}" for name in ("contact_wire_height", "running_surface")
    }
    turned_by_name |= {"irregularities.dropper_lengths", "vehicle.vertical", "vehicle.lateral"}
    free = {"line.wires.*", "line.links.*", "line.links.*.patterns.*"}
    assert found == turned_by_name | {"defects.*", "incidents.*"} | free


def test_a_line_that_is_turned_hangs_as_its_mirror_image() -> None:
    scene = scene_of(*ONE_SIDED)
    here, there = static_table(scene), static_table(turned(scene))
    length = line_of(scene).support_positions[-1]
    # Places are rounded to a nanometre; forces are those of two solves of one equilibrium, whose
    # matrices have a condition of 1e7.
    for name, sign in (("dropper_x", -1.0), ("dropper_length", 1.0), ("dropper_force", 1.0)):
        mirrored = there[name][::-1] * sign + (length if sign < 0 else 0.0)
        assert mirrored == pytest.approx(here[name], rel=1e-7, abs=1e-6), name
    # The middle span is the same one in both directions: what a force lifts there.
    assert there["elasticity"][::-1] == pytest.approx(here["elasticity"], rel=1e-7)
    assert not np.allclose(here["elasticity"], there["elasticity"], rtol=1e-2)
    assert np.ptp(here["dropper_force"]) > 50.0  # droppers differ, so that an order shows
    assert not np.allclose(here["dropper_force"], there["dropper_force"], rtol=1e-2)


@pytest.mark.parametrize(
    "wrong",
    [
        "irregularities.dropper_lengths.standard_deviation_mm=4",
        "irregularities.dropper_lengths.by_dropper=[[5, 3, 8.0]]",
        'defects=[{type = "missing_dropper", span = 5, dropper = 4}]',
    ],
)
def test_what_is_wrong_with_one_of_two_wires_stays_with_it(wrong: str) -> None:
    """Lateral positions stay, so that each of twin wires is its own mirror image."""
    words = ["line.n_spans=14", "mesh.elements_per_gap=2", "effects.relative_motion=true", wrong]
    scene = load_scene("dc_twin", [*words, "evaluation.from_m=385", "evaluation.to_m=440"])
    here, there = static_table(scene), static_table(turned(scene))
    one, other = np.split(here["contact_height"], 2)
    for own, name in ((one, "contact_wire"), (other, "contact_wire_2")):
        assert own.size == here[f"wires/{name}"].size
    mirrored = np.concatenate([half[::-1] for half in np.split(there["contact_height"], 2)])
    # Of two solves of one equilibrium, whose matrices have a condition of 1e7.
    assert mirrored == pytest.approx(here["contact_height"], rel=0.0, abs=1e-8)
    assert np.abs(one - other).max() > 1e-3  # so that an exchange of the wires shows


def test_turning_twice_gives_the_scene_that_was() -> None:
    scene = scene_of(*ONE_SIDED)
    once, twice = turned(scene), turned(turned(scene))
    assert plain(twice) == plain(turned(turned(twice)))
    again = plain(twice)
    assert again != plain(once)
    # Random errors are written out, dropper by dropper, from the first turn on.
    for part in ("line", "train", "evaluation", "defects"):
        assert again[part] == plain(scene)[part], part


@pytest.mark.parametrize("direction", [-360.0, -200.0, -90.0, 30.0, 360.0])
def test_wind_of_any_direction_blows_across_alike_and_along_against(direction: float) -> None:
    words = "windy_viaduct", [f"wind.direction_deg={direction}"]
    wind = turned(load_scene(*words)).wind
    assert wind is not None and abs(wind.direction_deg) <= 360.0
    here, there = np.deg2rad([direction, wind.direction_deg])
    # Angles of some radians are rounded to 1e-15 of them.
    assert (np.cos(there), np.sin(there)) == pytest.approx((-np.cos(here), np.sin(here)), abs=1e-14)


def test_the_run_in_is_as_long_in_both_directions() -> None:
    scene = scene_of("evaluation.from_m=330", "evaluation.to_m=1100")
    other = turned(scene)
    assert (other.evaluation.from_m, other.evaluation.to_m) == (550.0, 1320.0)
    assert other.train.start_m == 330.0
    near = turned(scene_of("evaluation.from_m=1100", "evaluation.to_m=1500"))
    assert near.train.start_m == 0.0  # 990 m of run-in do not fit


def test_the_whole_train_begins_on_the_line() -> None:
    """With the strips of the last pantograph, where a run-in of 990 m does not fit."""
    train = (
        "train.pantographs.1.name=three_masses",
        "train.pantographs.1.behind_m=60",
        "pantographs.three_masses.strips.number=2",
        "pantographs.three_masses.strips.spacing_m=0.5",
    )
    near = turned(scene_of("evaluation.from_m=1100", "evaluation.to_m=1500", *train))
    assert near.train.start_m == 60.25
    # Nor does a run-out of 240 m, to 1650 m.
    stretch = "evaluation.from_m=200", "evaluation.to_m=1400", "train.end_m=1640"
    assert turned(scene_of("train.start_m=100", *stretch, *train)).train.end_m == 1649.75


def test_a_symmetric_line_is_its_own_mirror_image() -> None:
    scene = scene_of()
    assert plain(turned(scene)) == plain(scene)
    early = scene_of("evaluation.from_m=330", "evaluation.to_m=1100")
    assert plain(turned(early)) != plain(early) and has_mirrored_line(early, turned(early))
    other = scene_of(*ONE_SIDED)
    assert not has_mirrored_line(other, turned(other))
    key = "irregularities.dropper_lengths.by_dropper"
    # Spans 1 to 30 of 9 droppers.
    here, there = (
        scene_of(f"{key}=[[2, 3, 1.0], [4, 5, 2.0]]"),
        f"{key}=[[27, 5, 2.0], [29, 7, 1.0]]",
    )
    assert plain(turned(here))["irregularities"] == plain(scene_of(there))["irregularities"]


@pytest.mark.parametrize(
    ("assignment", "key"),
    [
        ("irregularities.contact_wire_height.standard_deviation_mm=5", "contact_wire_height"),
        ("line.overlap={first_span = 5, rise_m = 0.2, distance_m = 0.4}", "line.overlap"),
    ],
)
def test_what_has_no_mirror_image_is_refused(assignment: str, key: str) -> None:
    scene = scene_of(assignment)
    with pytest.raises(InputError, match=rf"{key}.* has no mirror image"):
        turned(scene)
