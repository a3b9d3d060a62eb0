"""Random scenes draw every key that scenes may have; what they leave to other tests is listed."""

from __future__ import annotations

import re
import tomllib

from fuzzing import topology_scene, wide_scene
from scenes import Scene

from catenary.cases.scene.keys.keys import known_keys

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
