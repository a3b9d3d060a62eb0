"""Keys of scenes: ``catenary list --keys FILTER``, the JSON schema, what random scenes draw."""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from fuzzing import topology_scene, wide_scene
from scenes import Scene, load_scene
from verb_runner import invoke

from catenary import InputError
from catenary.cases.scene.keys.keys import known_keys
from catenary.cases.scene.keys.units import USUAL
from catenary.cases.terminal.lists import key_details, key_table, keys_of_a_scene, scene_schema

# --- ``catenary list --keys FILTER`` --------------------------------------------------------------


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


# --- the JSON schema of ``case.toml`` -------------------------------------------------------------


ROOT = Path(__file__).parents[2]
SCENES = sorted([*ROOT.glob("cases/*/case.toml"), *ROOT.glob("docs/examples/*.toml")])
SCHEMA = scene_schema()
VALIDATOR = jsonschema.Draft202012Validator(SCHEMA)


def faults(scene: dict[str, Any]) -> list[str]:
    """What the schema finds wrong, each fault with its place."""
    return [f"{error.json_path}: {error.message[:200]}" for error in VALIDATOR.iter_errors(scene)]


def simple() -> dict[str, Any]:
    return tomllib.loads((ROOT / "cases/en50318_2002/case.toml").read_text(encoding="utf-8"))


def test_the_schema_is_one() -> None:
    jsonschema.Draft202012Validator.check_schema(SCHEMA)


@pytest.mark.parametrize("file", SCENES, ids=lambda file: file.parent.name + "/" + file.stem)
def test_a_shipped_scene_fits(file: Path) -> None:
    assert faults(tomllib.loads(file.read_text(encoding="utf-8"))) == []


@pytest.mark.parametrize(
    ("table", "key", "value", "place"),
    [
        ("line", "spam_m", 50.0, "$.line"),
        ("line", "n_spans", "22", "$.line.n_spans"),
        ("line", "span_m", -1.0, "$.line.span_m"),
        ("numerics", "integrator", "euler", "$.numerics.integrator"),
        ("effects", "lateral_motoin", True, "$.effects"),
        ("line", "topology", "stiched", "$.line.topology"),
        ("evaluation", "system", "ac_25_kV", "$.evaluation.system"),
        ("evaluation", "edition", True, "$.evaluation.edition"),
    ],
)
def test_a_slip_does_not_fit(table: str, key: str, value: Any, place: str) -> None:
    scene = simple()
    scene.setdefault(table, {})[key] = value
    (fault,) = faults(scene)
    assert fault.startswith(f"{place}:")


@pytest.mark.parametrize(
    ("table", "key", "value"),
    [("evaluation", "edition", 2012), ("evaluation", "edition", "2012"), ("line", "span_m", [60])],
)
def test_what_may_be_written_in_two_ways_fits(table: str, key: str, value: Any) -> None:
    scene = simple()
    scene[table][key] = value
    assert faults(scene) == []


def test_a_pantograph_needs_its_lists_or_a_model() -> None:
    scene = simple()
    del scene["pantographs"]["reference"]["masses_kg"]
    assert faults(scene)


def test_the_schema_has_every_key_with_its_unit() -> None:
    tables = [SCHEMA, *SCHEMA["$defs"].values()]
    there = {key: spec for table in tables for key, spec in table.get("properties", {}).items()}
    lasts = {key.rpartition(".")[2] for key in known_keys(Scene)} - {"*"}
    assert lasts <= set(there) | set(SCHEMA["properties"]["effects"]["properties"])
    assert there["speed_km_h"]["description"].endswith("[km/h]")


def test_list_prints_it() -> None:
    told = invoke("list", "--schema")
    assert json.loads(told.output) == SCHEMA
    both = invoke("list", "--schema", "--keys")
    assert both.exit_code == 2 and "--keys and --schema" in both.output


# --- random scenes draw every key that scenes may have; what they leave to other tests is ---------


MOST_SEEDS = 4000
# Left to tests of their own: texts, files, mechanisms as data, options of PETSc, what is written.
ELSEWHERE = re.compile(
    r"case\b|test\b|petsc\b|output\b|evaluation\.(edition|system|rules|own_rules|limits)\b|mesh\.file|.*_file$|.*\.patterns\.\*\.spans$"
    r"|pantographs\.\*\.(type|head|arm|actuator|calibrate|working_height_m|assembly_tolerance_m"
    r"|gravity|as_published|bodies|joints|forces|corrections)\b"
    r"|numerics\.(eps_\w+|max_iterations)|effects\.(vertical|gravity|several_pantographs)"
)


def draw(found: set[str], seed: int) -> None:
    """Add the keys of the scenes of a seed, entries of lists as ``*``."""
    for made in (topology_scene(seed), wide_scene(seed)):
        for assignment in made.assignments:
            key, value = assignment.split("=", 1)
            if value:
                put(found, key, tomllib.loads(f"x={value}")["x"])


def put(found: set[str], key: str, value: object) -> None:
    parts = ["*" if part.isdigit() else part for part in key.split(".")]
    found |= {".".join(parts[:n]) for n in range(1, len(parts) + 1)}
    if isinstance(value, dict):
        for name, inner in value.items():
            put(found, f"{key}.{name}", inner)
    elif isinstance(value, list):
        for inner in value:
            if isinstance(inner, dict):
                put(found, f"{key}.0", inner)


def test_every_key_of_a_scene_is_drawn_or_left_to_a_test_of_its_own() -> None:
    found: set[str] = set()
    missing = [key for key in known_keys(Scene) if not ELSEWHERE.match(key)]
    for seed in range(MOST_SEEDS):
        draw(found, seed)
        if seed % 200 == 199:
            missing = [key for key in missing if not is_in(found, key)]
        if not missing:
            return
    raise AssertionError(", ".join(missing))


def is_in(found: set[str], key: str) -> bool:
    pattern = re.compile(re.escape(key).replace(r"\*", r"[^.]+"))
    return any(pattern.fullmatch(one) for one in found)
