"""Unit tests start no process unless they say so, so that ``make check`` stays quick."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

HERE = Path(__file__).parent
_running: list[pytest.Item] = []  # the test under way, with the making of its fixtures
_start = subprocess.Popen.__init__


def _announced(self: Any, *words: Any, **settings: Any) -> None:
    """Start a process, if the test under way carries the mark ``process``."""
    for item in _running:
        if item.get_closest_marker("process") is None:
            pytest.fail(f"{item.name} starts a process: mark it with @pytest.mark.process")
    _start(self, *words, **settings)


def pytest_configure() -> None:
    """Every program is started by way of ``Popen``."""
    setattr(subprocess.Popen, "__init__", _announced)  # noqa: B010 - mypy refuses the assignment


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Iterator[None]:
    """Remember the test whose fixtures and lines are under way."""
    if item.path.is_relative_to(HERE):
        _running.append(item)
    try:
        return (yield)
    finally:
        _running.clear()
