"""Scenes as command lines give them, and what the program makes of one.

Tests take it from here: this is the only file of theirs that knows where it stands. What a user of
Python has of a scene is ``catenary.load``.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import catenary
from catenary.cases.run.scene_mesh import mesh_of
from catenary.cases.scene.input.case_files import find_case, shipped
from catenary.cases.scene.input.faults import Origin
from catenary.cases.scene.load import load_scene, read_draft, scene_from
from catenary.cases.scene.scene import Scene, line_of, problem_of, resolved
from catenary.meshgen.topologies.line_data import LineData
from catenary.scenes import Scene as SceneOfUsers

__all__ = [
    "TINY",
    "TINY_WORDS",
    "Scene",
    "find_case",
    "line_data_of",
    "line_of",
    "load_scene",
    "mesh_of",
    "problem_of",
    "read_draft",
    "recorded",
    "resolved",
    "scene_from",
    "shipped",
    "with_words",
]

# The reference model of EN 50318 with six spans and one element a gap, run through in 460 steps.
TINY: dict[str, Any] = {
    "line.n_spans": 6,
    "mesh.elements_per_gap": 1,
    "train.start_m": 65.0,
    "train.end_m": 257.0,
    "train.raise_time_s": 0.2,
    "numerics.dt_s": 0.005,
    "evaluation.from_m": 120.0,
    "evaluation.to_m": 240.0,
}
# The same as words, with nothing but channels recorded.
TINY_WORDS = (
    *(f"{key}={value}" for key, value in TINY.items()),
    "output.field_every_s=0",
    "output.energy_every_s=0",
)


def line_data_of(scene: Scene) -> LineData:
    """The line of a scene as topologies take it."""
    return scene.line_data


def with_words(case: str | Path, words: Sequence[str] = (), short: bool = False) -> catenary.Scene:
    """A scene for the Python package, with what a command line gives it by ``--set``."""
    return SceneOfUsers(read_draft(case, words, short))


def recorded(scene: Scene) -> Scene:
    """The scene that a result which recorded this one gives again."""
    return scene_from(resolved(scene), Origin("a result", recorded=True))
