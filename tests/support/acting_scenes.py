"""The small scenes of `regression/acting_keys/acting.toml`, which together have every key."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from scenes import Scene, find_case, load_scene

_TESTS = Path(__file__).parents[1]
_EXAMPLES = _TESTS.parent / "docs/examples"
SCENES: dict[str, dict[str, Any]] = tomllib.loads(
    (_TESTS / "regression/acting_keys/acting.toml").read_text(encoding="utf-8")
)


def acting_scene(name: str, changes: Sequence[str] = ()) -> Scene:
    """One of them, with further assignments."""
    table = SCENES[name]
    example = _EXAMPLES / table["case"]
    case = example if example.is_file() else find_case(table["case"])
    return load_scene(case, [*table["set"], *changes])
