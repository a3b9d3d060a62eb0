"""The shipped cases, found from their folders, and the file that a case argument stands for."""

from __future__ import annotations

import difflib
from pathlib import Path

from catenary.base.errors import InputError
from catenary.base.options import option
from catenary.cases.scene.input.plain_text import plain
from catenary.cases.scene.input.toml_input import read_toml

CASES = Path(__file__).resolve().parents[2]
CASE_FILE = "case.toml"


def shipped() -> dict[str, Path]:
    """Case files of the shipped cases by name, in alphabetical order."""
    return {path.parent.name: path for path in sorted(CASES.glob(f"*/{CASE_FILE}"))}


def titles() -> dict[str, str]:
    """Titles of the shipped cases by name, which are read without checking the rest."""
    return {name: _title(path) for name, path in shipped().items()}


def _title(path: Path) -> str:
    """``case.title`` of a case file, empty if it has none."""
    case = read_toml(path).get("case")
    return str(case.get("title", "")) if isinstance(case, dict) else ""


def find_case(case: str) -> Path:
    """The case file that ``case`` stands for: a shipped case's name, a file, or a folder with one.

    Raises
    ------
    InputError
        If there is none.
    """
    known = shipped()
    if not case.strip():
        raise InputError(
            "the case has no name: name a shipped case "
            f"({option('`catenary list`', 'shipped_cases()')}), a case.toml or its folder"
        )
    if case in known:
        return known[case]
    try:
        path = Path(case).expanduser()
        if path.is_dir() and (path / CASE_FILE).is_file():
            return path / CASE_FILE
        if path.is_file():
            return path
        exists = path.exists()
    except (OSError, ValueError, RuntimeError):  # names too long, null bytes, unknown users
        exists = False
    if exists:
        raise InputError(f"{case} is no case file and no folder that holds a {CASE_FILE}")
    near = difflib.get_close_matches(case, known, n=1)
    hint = f"did you mean {near[0]}?" if near else f"shipped cases are {', '.join(known)}"
    raise InputError(f"there is no case or file named {plain(case, 200)}; {hint}")
