"""The JSON schema of ``case.toml``: what is shipped fits it, and what is refused does not."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from scenes import Scene
from verb_runner import invoke

from catenary.cases.scene.keys.keys import known_keys
from catenary.cases.terminal.lists import scene_schema

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
