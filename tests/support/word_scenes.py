"""Scenes for Python that are changed by the words of a command line."""

from __future__ import annotations

from collections.abc import Iterable

import catenary
from catenary.cases.scene.input.toml_input import parse_assignment


def with_words(case: str, words: Iterable[str]) -> catenary.Scene:
    """A scene with the assignments of a command line, such as ``line.n_spans=10``."""
    return catenary.load(case).replace(dict(map(parse_assignment, words)))
