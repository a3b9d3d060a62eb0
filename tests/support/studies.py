"""Parameters of tests of which every run tries a few, and studies try all."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import pytest


def few(cases: Iterable[Any], *quick: Any) -> list[Any]:
    """All cases; those that are not ``quick`` carry the mark ``study``."""
    cases = list(cases)
    assert quick and all(case in cases for case in quick), quick
    return [pytest.param(case, marks=() if case in quick else pytest.mark.study) for case in cases]


def few_values(cases: Mapping[str, Any], *quick: str) -> list[Any]:
    """Values of all cases, named by their keys; those that are not ``quick`` carry ``study``."""
    assert quick and set(quick) <= set(cases), quick
    return [
        pytest.param(value, id=name, marks=() if name in quick else pytest.mark.study)
        for name, value in cases.items()
    ]
