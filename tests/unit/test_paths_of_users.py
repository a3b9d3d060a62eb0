"""Paths that cannot be looked up: one sentence by every verb that is given one."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import pytest
from verb_runner import invoke

from catenary import InputError
from catenary import open as open_run
from catenary.base import files
from catenary.cases.result_folder.output_folder import run_folder
from catenary.postproc.files.disk import write_all

TOO_LONG = "x" * 300
VERBS = {
    "report": ["report", TOO_LONG],
    "restart": ["restart", TOO_LONG],
    "compare": ["compare", TOO_LONG, "other"],
    "worst": ["worst", TOO_LONG],
    "waves": ["waves", TOO_LONG],
    "merge": ["merge", TOO_LONG, "other", "-o", "out"],
    "uncertainty": ["uncertainty", TOO_LONG],
    "static": ["static", "ac_simple", "-o", f"{TOO_LONG}.csv"],
    "submit": ["submit", TOO_LONG, "-o", "out", "--print"],
    "new": ["new", TOO_LONG],
}


@pytest.mark.parametrize("verb", VERBS)
def test_a_name_that_is_too_long_is_told(
    verb: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    result = invoke(*VERBS[verb])
    told = result.stderr.strip()
    assert result.exit_code == 2 and told.startswith("catenary: ") and "\n" not in told, told
    wanted = ("File name too long", "there is no case or file", "it must be a path")
    assert any(words in told for words in wanted), told
    assert list(tmp_path.iterdir()) == []


def test_a_folder_of_another_user_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Said by the system to all but root."""

    stat = os.stat

    def refuses(path: Any, **how: Any) -> os.stat_result:
        if "theirs" in Path(path).parts:
            raise PermissionError(13, "Permission denied", str(path))
        return stat(path, **how)

    told = r"/theirs cannot be looked up \(Permission denied\): ask the owner"
    with monkeypatch.context() as patch:
        patch.setattr(os, "stat", refuses)
        for asks in (files.is_file, files.is_folder, files.is_there, open_run):
            with pytest.raises(InputError, match=told):
                asks(tmp_path / "theirs")
        # Not by the parser of the option, whose errors nobody catches.
        assert run_folder(tmp_path / "theirs" / "run.h5") == tmp_path / "theirs" / "run.h5"


def test_links_in_a_circle_name_nothing(tmp_path: Path) -> None:
    (tmp_path / "a").symlink_to("a")
    assert not files.is_there(tmp_path / "a") and not files.is_file(Path("a\0b"))
    assert files.is_folder(tmp_path) and not files.is_there(tmp_path / "a" / "b")


def test_folders_of_any_depth_are_made(tmp_path: Path) -> None:
    (tmp_path / "stays").touch()
    deep = tmp_path / "/".join("a" * 1500)
    (made,) = write_all(deep, {"b": "c"})
    assert made.read_text() == "c"
    made.unlink()
    os.removedirs(deep)  # pytest removes folders by a recursion


def test_a_new_case_at_a_link_in_a_circle_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("a").symlink_to("a")
    result = invoke("new", "a")
    assert result.exit_code == 2 and result.stderr.startswith("catenary: a cannot be made"), result
