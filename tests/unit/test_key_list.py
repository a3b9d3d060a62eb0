"""``catenary list --keys FILTER``: bounds, words, defaults and typical values of keys."""

from __future__ import annotations

import re

import pytest
from scenes import load_scene
from verb_runner import invoke

from catenary import InputError
from catenary.cases.scene.keys.units import USUAL
from catenary.cases.terminal.lists import key_details, key_table, keys_of_a_scene


def first_words(text: str) -> list[str]:
    """The keys that details are of."""
    return [line.split()[0] for line in text.splitlines() if not line.startswith(" ")]


def keys_like(pattern: str) -> list[str]:
    """Keys with a name of a form, of whichever wires a line may have."""
    names = [key.name for key in keys_of_a_scene() if re.fullmatch(pattern, key.name)]
    assert "contact_wire" in names[0] and len(names) > 3
    return names


@pytest.mark.parametrize(
    ("wanted", "keys"),
    [
        ("bending_stiffness", keys_like(r".+\.bending_stiffness_N_m2")),
        ("line.*_wire.tension_N", keys_like(r"line\.[a-z]+_wire\.tension_N")),
        ("SPEED_km", ["train.speed_km_h"]),
        ("vehicle.irregularity.s???", ["vehicle.irregularity.seed"]),
        ("accepted in one step", ["numerics.adaptive_tolerance_N"]),  # a meaning
    ],
)
def test_a_filter_is_a_part_or_a_pattern(wanted: str, keys: list[str]) -> None:
    assert first_words(key_details(wanted)) == keys


@pytest.mark.parametrize(
    ("key", "said"),
    [
        ("line.damping.alpha_s", "required; number from 0 to 10"),
        ("line.contact_wire.tension_N", "number above 0 to 1000000"),
        ("line.dropper.residual_stiffness_ratio", "default 0.0; number from 0 to below 1"),
        ("mesh.elements_per_gap", "whole number from 1 to 128"),
        ("numerics.integrator", "one of newmark, hht, generalized_alpha"),
        ("evaluation.edition", "one of 2006, 2012, 2020"),
        ("evaluation.system", "one of ac, dc_3kv, dc_1500v"),
        ("effects.head_roll", "default false; true or false"),
        (
            "effects.gusts",
            "requires effects.wind acts only with a table [wind.gusts] in a wind above 0 source:",
        ),
        ("line.steady_arm.holds_height", "default false; true or false"),
        (
            "pantographs.*.masses_kg",
            "list of 1 to 20, each number from 0.001 to 1000; only of lumped",
        ),
        ("petsc.march_pc_asm_type", "one of basic, restrict, interpolate, none"),
        ("train.end_m", "may be left out; number"),
    ],
)
def test_bounds_and_words_are_told(key: str, said: str) -> None:
    told = " ".join(key_details(key).split())
    assert said in told


def test_every_key_has_details() -> None:
    names = [key.name for key in keys_of_a_scene()]
    assert first_words(key_details("*")) == names
    for name in names[::10]:
        assert key_details(name).startswith(name)


def test_the_words_that_are_told_are_those_that_are_accepted() -> None:
    told = " ".join(key_details("vehicle.irregularity.spectrum").split())
    for word in told.split("one of ")[1].split(", "):
        scene = load_scene(
            "en50318_2002",
            [f'vehicle.irregularity.spectrum="{word}"', "effects.vehicle_motion=true"],
        )
        assert scene.vehicle is not None


def test_damping_and_bending_stiffness_have_typical_values() -> None:
    known = {key.name for key in keys_of_a_scene()}
    assert set(USUAL) <= known
    for key in ("line.damping.alpha_s", "line.damping.beta_per_s",
                "line.contact_wire.bending_stiffness_N_m2"):  # fmt: skip
        assert "typical: " in key_details(key)
    required = {
        key.name
        for key in keys_of_a_scene()
        if key.default == "required" and key.name.startswith(("line.", "train.s"))
    }
    without = {
        name
        for name in required - {key for key, usual in USUAL.items() if usual.words}
        if "per_component" not in name
    }
    assert all(".patterns.*." in name for name in without)


def test_what_fits_no_key_is_one_sentence() -> None:
    with pytest.raises(InputError, match='no key of a scene fits "tensoin"; did you mean tension'):
        key_details("tensoin")
    done = invoke("list", "--keys", "\x1b[31m")
    assert done.exit_code == 2 and "\x1b" not in done.output
    assert invoke("list", "damping").exit_code == 2
    assert "list --keys damping" in invoke("list", "damping").output


def test_all_keys_are_one_line_each() -> None:
    lines = key_table().splitlines()
    assert len(lines) == len(keys_of_a_scene())
    assert invoke("list", "--keys").stdout.splitlines() == lines
