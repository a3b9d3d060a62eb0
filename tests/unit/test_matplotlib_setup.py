"""Matplotlib's own cache: its default if that can be written, else a folder of the program."""

from __future__ import annotations

import logging
import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from catenary.cases.process import libraries


@pytest.fixture(autouse=True)
def no_choice(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setenv(libraries.CACHE_VARIABLE, "")  # so that it is put back at the end
    monkeypatch.delenv(libraries.CACHE_VARIABLE)
    level = logging.getLogger("matplotlib").level
    yield
    logging.getLogger("matplotlib").setLevel(level)


def test_a_home_that_can_be_written_is_left_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "not" / "yet"))
    libraries.choose_matplotlib_folder()
    assert libraries.CACHE_VARIABLE not in os.environ


@pytest.mark.parametrize("home", ["file", "x" * 300])  # a name too long cannot be looked up
def test_without_a_home_it_is_in_a_folder_of_the_program(
    home: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / home))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "kept"))
    libraries.choose_matplotlib_folder()
    assert os.environ[libraries.CACHE_VARIABLE] == str(
        tmp_path / "kept" / "catenary" / "matplotlib"
    )


def test_without_any_folder_it_is_silent(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "file"))
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setattr(libraries.tempfile, "gettempdir", lambda: str(tmp_path / "file"))
    libraries.choose_matplotlib_folder()
    assert libraries.CACHE_VARIABLE not in os.environ
    assert not logging.getLogger("matplotlib").isEnabledFor(logging.WARNING)
