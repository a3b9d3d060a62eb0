"""The state of ParaView, made by a stand-in for its program; `tests/paraview` has the true one."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from catenary.postproc.film import open_in_paraview

# What starts a program is run by processes of its own.
pytestmark = pytest.mark.process

WRITES = 'while [ "$1" != --state ]; do shift; done; echo "<ParaView/>" > "$2"'


@pytest.fixture
def script(tmp_path: Path) -> Path:
    path = tmp_path / "view.py"
    path.write_text("pass")
    return path


def on_the_path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, **programs: str) -> None:
    """Let these programs of the shell be the first on the path."""
    folder = tmp_path / "bin"
    folder.mkdir()
    for name, text in programs.items():
        program = folder / name.replace("_", "-")
        program.write_text(f"#!/bin/sh\n{text}\n")
        program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{folder}{os.pathsep}/nowhere")


def test_the_state_stands_beside_the_script(
    script: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("DISPLAY", ":7")
    on_the_path(tmp_path, monkeypatch, pvpython=WRITES)
    made, why = open_in_paraview.write_state(script)
    assert made == tmp_path / "view.pvsm" and made.read_text() == "<ParaView/>\n" and why == ""


def test_without_a_screen_one_is_made(
    script: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.setattr(open_in_paraview.sys, "platform", "linux")
    # A screen that starts anew while ParaView is not connected refuses it now and then.
    stays = 'case "$*" in *-noreset*) ;; *) exit 4 ;; esac; '
    on_the_path(tmp_path, monkeypatch, pvpython="exit 3", xvfb_run=stays + WRITES)
    assert open_in_paraview.write_state(script)[0] == tmp_path / "view.pvsm"


@pytest.mark.parametrize(
    ("programs", "told"),
    [
        ({}, "pvpython is not on this machine"),
        ({"pvpython": WRITES}, "needs a screen, or xvfb-run"),
        ({"pvpython": WRITES, "xvfb_run": "echo no screen left >&2; exit 1"}, "no screen left"),
        ({"pvpython": WRITES, "xvfb_run": "exit 0"}, "it wrote nothing"),
    ],
)
def test_where_there_is_none_one_sentence_says_why(
    programs: dict[str, str],
    told: str,
    script: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.setattr(open_in_paraview.sys, "platform", "linux")
    (tmp_path / "view.pvsm").write_text("an earlier one")
    on_the_path(tmp_path, monkeypatch, **programs)
    made, why = open_in_paraview.write_state(script)
    assert made is None and told in why and "no state is written" in why
    assert (tmp_path / "view.pvsm").read_text() == "an earlier one"
    assert not list(tmp_path.glob(".view*"))
