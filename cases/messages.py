"""One sentence for each thing that is wrong with a scene."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NoReturn

from pydantic import BaseModel, ValidationError

from catenary.cases.input.petsc_table import ELSEWHERE
from catenary.cases.keys import is_known, known_keys, nearest, without_kinds
from catenary.cases.units import unit_of
from catenary.solver.errors import InputError

_SHOWN = 60
COMMAND_LINE = "on the command line (--set)"


@dataclass(frozen=True)
class Origin:
    """Where a scene's keys were written: its file, the keys given by ``--set``, and pairs of a key
    and the file that its value was read from."""

    file: str
    overridden: tuple[str, ...] = ()
    taken_in: tuple[tuple[str, str], ...] = ()

    def of(self, key: str) -> str:
        """Place of a key, with its preposition, for use in a sentence."""
        for above, file in self.taken_in:
            if key == above or key.startswith(above + "."):
                return f"in {file}"
        for given in self.overridden:
            if key == given or key.startswith(given + ".") or given.startswith(key + "."):
                return COMMAND_LINE
        return f"in {self.file}"


def shown(value: Any) -> str:
    """A value as a person would write it, shortened."""
    if isinstance(value, bool):
        return "true" if value else "false"
    try:
        text = f'"{value}"' if isinstance(value, str) else str(value)
    except ValueError:  # integers of thousands of digits
        text = "a number of thousands of digits"
    text = "".join(c if c.isprintable() else "?" for c in text)
    return text if len(text) <= _SHOWN else text[: _SHOWN - 3] + "..."


def refuse(origin: Origin, key: str, value: object, why: str) -> NoReturn:
    """Raise the ``InputError`` that says what a key is, where it was written, and why it cannot."""
    unit = unit_of(key)
    number = f"{value:g}" if isinstance(value, float) else shown(value)
    in_unit = f" {unit}" if unit else ""
    raise InputError(f"{key} is {number}{in_unit} {origin.of(key)}; {why}")


def unknown_key(key: str, where: str, known: list[str]) -> str:
    """The sentence for a key that the scene does not know."""
    near = nearest(key, known)
    if key.startswith("petsc."):
        hint = f"; did you mean {near}?" if near and near.startswith("petsc.") else ""
        return f"{shown(key)[1:-1]} {where} {ELSEWHERE}{hint}"
    hint = f"; did you mean {near}?" if near else "; see `catenary list --keys` for all keys"
    return f"{shown(key)[1:-1]} {where} is unknown{hint}"


def _or(listed: str) -> str:
    """A list "a, b, c" as "a, b or c"."""
    return " or ".join(listed.rsplit(", ", 1))


# What pydantic's error types ask for, completed with the error's own limits.
_WANTED: dict[str, Callable[[dict[str, Any]], str]] = {
    "greater_than": lambda c: f"must be greater than {c['gt']:g}",
    "greater_than_equal": lambda c: f"must be at least {c['ge']:g}",
    "less_than": lambda c: f"must be less than {c['lt']:g}",
    "less_than_equal": lambda c: f"must be at most {c['le']:g}",
    "finite_number": lambda c: "must be a finite number",
    "float_type": lambda c: "must be a number",
    "int_type": lambda c: "must be a whole number",
    "int_from_float": lambda c: "must be a whole number",
    "bool_type": lambda c: "must be true or false",
    "string_type": lambda c: "must be text",
    "list_type": lambda c: "must be a list",
    "dict_type": lambda c: "must be a table",
    "model_type": lambda c: "must be a table",
    "literal_error": lambda c: f"must be {c['expected'].replace(chr(39), '')}",
    "too_short": lambda c: (
        f"must have at least {c['min_length']} {'entry' if c['min_length'] == 1 else 'entries'}"
    ),
    "too_long": lambda c: f"must have at most {c['max_length']} entries",
    "string_too_short": lambda c: "must not be empty",
    "string_too_long": lambda c: f"must have at most {c['max_length']} characters",
    "value_error": lambda c: str(c["error"]),
    "union_tag_invalid": lambda c: (
        f"must be of type {_or(c['expected_tags'].replace(chr(39), ''))}, not {c['tag']}"
    ),
    "union_tag_not_found": lambda c: "must have a type",
}
_OF_A_NUMBER = (
    "greater_than",
    "greater_than_equal",
    "less_than",
    "less_than_equal",
    "finite_number",
    "float_type",
)


def input_error(
    failed: ValidationError, raw: dict[str, Any], model: type[BaseModel], origin: Origin
) -> InputError:
    """The first problem of a validation as one sentence that counts the others."""
    problems = failed.errors(include_url=False)
    # A misspelt key often shows up as a missing one too: the misspelling is the cause.
    problems.sort(key=lambda p: 0 if p["type"] == "extra_forbidden" else 1)
    text = _sentence(dict(problems[0]), raw, model, origin)
    if len(problems) > 1:
        more = len(problems) - 1
        text += f" (and {more} more {'problem' if more == 1 else 'problems'})"
    return InputError(text)


def _sentence(
    problem: dict[str, Any], raw: dict[str, Any], model: type[BaseModel], origin: Origin
) -> str:
    parts, field = without_kinds(problem["loc"], model)
    location = _location(parts, raw)
    key = ".".join(location) or "the scene"
    where = origin.of(key)
    kind = problem["type"]
    if kind == "extra_forbidden":
        of_this_kind = known_keys(model, problem["loc"])
        if not is_known(key, of_this_kind) and is_known(key, known_keys(model)):
            return f"{key} {where} does not belong to type {_kind(problem['loc'], parts)}"
        return unknown_key(key, where, of_this_kind)
    if kind == "missing":
        meaning = field.description if field is not None else ""
        return f"{key}{f' ({meaning})' if meaning else ''} is missing {where}"
    wanted = _WANTED.get(kind, lambda c: problem["msg"])(problem.get("ctx") or {})
    value = problem["input"]
    if isinstance(value, dict | BaseModel):
        return f"{key} {where} {wanted}"
    unit = unit_of(key)
    shown_unit = f" [{unit}]" if unit and kind in _OF_A_NUMBER else ""
    return f"{key} is {shown(value)} {where}; it {wanted}{shown_unit}"


def _kind(loc: Sequence[int | str], parts: Sequence[int | str]) -> str:
    """The last kind of table in a pydantic location, from what is left without kinds."""
    left, kind = list(parts), ""
    for part in loc:
        if left and part == left[0]:
            left.pop(0)
        else:
            kind = str(part)
    return kind


def _location(loc: Sequence[int | str], raw: Any) -> list[str]:
    """The part of a pydantic location that exists as written, with the missing or extra key."""
    parts: list[str] = []
    for part in loc:
        if part == "[key]":
            break
        if isinstance(part, int) and not isinstance(raw, list):
            break  # one number was written where a list may stand
        parts.append(str(part))
        if isinstance(raw, dict):
            raw = raw.get(part)
        elif isinstance(raw, list) and isinstance(part, int) and part < len(raw):
            raw = raw[part]
        else:
            raw = None
    return parts
