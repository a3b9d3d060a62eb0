"""The version stands in pyproject.toml; what else states it agrees."""

from __future__ import annotations

import re
import tomllib
from datetime import date
from importlib import metadata
from pathlib import Path

from verb_runner import invoke

ROOT = Path(__file__).parents[2]
VERSION = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
HEADING = re.compile(r"^## (?!Unreleased)(\S+) - (\d{4}-\d\d-\d\d)$", re.MULTILINE)


def citation() -> dict[str, str]:
    """Entries of CITATION.cff that stand on one line."""
    text = (ROOT / "CITATION.cff").read_text()
    return dict(re.findall(r"^([\w-]+): (.+)$", text, re.MULTILINE))


def test_the_installed_program_tells_it() -> None:
    assert metadata.version("catenary") == VERSION, "run make setup"
    assert invoke("--version").stdout.splitlines()[0] == f"catenary {VERSION}"


def test_the_changelog_begins_with_unreleased_changes_and_then_has_it() -> None:
    text = (ROOT / "CHANGELOG.md").read_text()
    headings = re.findall(r"^## (.+)$", text, re.MULTILINE)
    assert headings[0] == "Unreleased"
    released = HEADING.findall(text)
    assert len(released) == len(headings) - 1
    assert released[0][0] == VERSION
    days = [date.fromisoformat(day) for _, day in released]
    assert days == sorted(days, reverse=True)


def test_the_citation_has_it_with_its_day() -> None:
    released = dict(HEADING.findall((ROOT / "CHANGELOG.md").read_text()))
    assert citation()["version"] == VERSION
    assert citation()["date-released"] == released[VERSION]
