"""Case files: found by name, file or folder, read as one nested table, changed by assignments.

Nothing is judged here. Shipped cases are found from their folders; ``--set`` assignments go into
the same table as a file.
"""

from __future__ import annotations

import copy
import difflib
import re
import tomllib
from pathlib import Path
from typing import Any, NamedTuple

from catenary.base.errors import InputError
from catenary.base.options import option
from catenary.cases.scene.input.faults import COMMAND_LINE, shown
from catenary.cases.scene.input.plain_text import DEEPEST, plain, read_text

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


# A key part and its dot; more of them in a row make a table that is nested too deeply, which would
# take the parser a time that grows with their square.
_PART = r"""(?:[A-Za-z0-9_-]+|"(?:[^"\\\n]|\\.)*"|'[^'\n]*')[ \t]*\.[ \t]*"""
_DEEP_KEY = re.compile(rf"(?:^|[\[{{,])[ \t]*(?:{_PART}){{{DEEPEST}}}", re.MULTILINE)


def read_toml(path: Path) -> dict[str, Any]:
    """Contents of a TOML file in UTF-8, with or without a byte order mark.

    Raises
    ------
    InputError
        If the file cannot be read or is not TOML.
    """
    text = read_text(path, str(path))
    deep = _DEEP_KEY.search(text)
    if deep is not None:
        line = text.count("\n", 0, deep.start() + 1) + 1
        raise InputError(f"{path} has in line {line} a key of more than {DEEPEST} parts")
    try:
        return tomllib.loads(text)
    except RecursionError as error:
        raise InputError(f"{path} is nested too deeply") from error
    except ValueError as error:  # TOMLDecodeError, and integers of thousands of digits
        raise InputError(f"{path} is not valid TOML: {_toml_words(error)}") from error


def _toml_words(error: ValueError) -> str:
    """The parser's message with keys as TOML writes them; it also fails on long integers."""
    if not isinstance(error, tomllib.TOMLDecodeError):
        return "a number is too long"
    keys = re.compile(r"\((?:'[^']*'(?:, )?)+,?\)")
    return plain(keys.sub(lambda m: ".".join(re.findall(r"'([^']*)'", m[0])), str(error)), 300)


# The value of ``key=``: the key is removed, so that its default holds.
REMOVED = object()


class Assigned(NamedTuple):
    """An assignment ``key=value``, the option that gave it, and its place for use in a sentence."""

    text: str
    option: str = "--set"
    where: str = COMMAND_LINE


def parse_assignment(text: str, option: str = "--set") -> tuple[str, Any]:
    """Key and value of ``key=value``; the value is read as TOML, as plain text if it is none.

    An empty value is ``REMOVED``. ``option`` names in an error what gave it.

    Raises
    ------
    InputError
        If it has another form, or a key that no scene can have.
    """
    key, equals, value = text.partition("=")
    key = key.strip()
    if not equals or not key or any(not part for part in key.split(".")):
        raise InputError(
            f"{option} {shown(text)} must have the form key=value, e.g. train.speed_km_h=300"
        )
    if key.count(".") >= DEEPEST:
        raise InputError(f"{option} {shown(key)} has a key of more than {DEEPEST} parts")
    if not value.strip():
        return key, REMOVED
    try:
        parsed = tomllib.loads(f"value = {value}")
    except (ValueError, RecursionError):
        return key, value.strip()
    if set(parsed) != {"value"}:
        return key, value.strip()
    return key, parsed["value"]


def assign(raw: dict[str, Any], key: str, value: Any, where: str = COMMAND_LINE) -> None:
    """Set a dotted key in a nested table, making the tables on the way; ``REMOVED`` takes it away.

    A number in the key is an index into a list; the number after the last one appends. Tables below
    ``raw`` are not changed but take the place of others. ``where`` says in an error where the
    assignment was written.

    Raises
    ------
    InputError
        If the key leads through something that is neither a table nor a list.
    """
    parts = key.split(".")
    if parts[0] == "test" and len(parts) > 2:
        parts = [parts[0], ".".join(parts[1:])]  # its keys hold dots
    here: Any = raw
    for depth, part in enumerate(parts):
        last = depth == len(parts) - 1
        if isinstance(here, list):
            place: Any = _index(here, parts, depth, where)
            if place == len(here):
                if value is REMOVED:
                    return  # nothing to take away
                here.append({})
        elif isinstance(here, dict):
            place = part
            if not last and part not in here:
                if value is REMOVED:
                    return
                here[part] = {}
        else:
            above = ".".join(parts[:depth])
            raise InputError(
                f"{shown(key)[1:-1]} cannot be set {where}: {above} is {shown(here)} and no table"
            )
        if not last:
            here[place] = copy.copy(here[place])
            here = here[place]
        elif value is not REMOVED:
            here[place] = value
        elif isinstance(here, list) or place in here:
            del here[place]


def value_at(tables: Any, key: str) -> Any:
    """The value of a dotted key in nested tables, None if there is none; numbers index lists.

    Parameters
    ----------
    tables : of a scene, as a case file or ``resolved`` gives them
    """
    here = tables
    for part in key.split("."):
        if isinstance(here, list) and part.isdigit() and int(part) < len(here):
            here = here[int(part)]
        else:
            here = here.get(part) if isinstance(here, dict) else None
    return here


def _index(here: list[Any], parts: list[str], depth: int, where: str) -> int:
    """The index that a key names in a list, at most one past its last entry."""
    above, part = ".".join(parts[:depth]), parts[depth]
    index = int(part) if part.isascii() and part.isdigit() and len(part) < 6 else -1
    if not 0 <= index <= len(here):
        raise InputError(
            f"{shown('.'.join(parts))[1:-1]} cannot be set {where}: {above} is a list of "
            f"{len(here)}, so that a number from 0 to {len(here)} must follow it"
        )
    return index
