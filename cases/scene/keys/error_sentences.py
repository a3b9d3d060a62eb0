"""Error messages for invalid scenes, one sentence each."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo

from catenary.cases.scene.input.faults import MOST_TOLD, Fault, Origin, shown
from catenary.cases.scene.input.plain_text import plain
from catenary.cases.scene.keys.keys import is_known, known_keys, nearest, without_kinds
from catenary.cases.scene.keys.units import unit_of
from catenary.cases.scene.keys.usual_values import unit_guess, usual_range

_LONGEST_KEY = 200  # of one in a sentence
_LONGEST_TAG = 60


def refusal(
    origin: Origin, key: str, value: object, why: str, *, by_default: bool = False
) -> Fault:
    """The fault of a key with its value, the place where it was written, and the reason ``why``."""
    unit = unit_of(key)
    number = f"{value:g}" if isinstance(value, float) else shown(value)
    in_unit = f" {unit}" if unit else ""
    how = "by default, as it is not given " if by_default else ""
    return Fault(key, f"{key} is {number}{in_unit} {how}{origin.of(key)}; {why}")


def unknown_key(key: str, where: str, known: Sequence[str]) -> str:
    """The sentence for an unknown key, written at ``where``, with the nearest of the ``known``."""
    near, name = nearest(key, known), shown(key)[1:-1] or '""'
    if key.startswith("petsc."):
        hint = f"; did you mean {near}?" if near and near.startswith("petsc.") else ""
        return f"{name} {where} {ELSEWHERE}{hint}"
    hint = f"; did you mean {near}?" if near else "; see `catenary list --keys` for all keys"
    return f"{name} {where} is unknown{hint}"


def _or(listed: str) -> str:
    """A list "a, b, c" as "a, b or c"."""
    return " or ".join(listed.rsplit(", ", 1))


# Requirements by pydantic's error types, completed with the error's own limits.
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
    "list_type": lambda c: "must be a list, in brackets",
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
        f"must be of type {_or(c['expected_tags'].replace(chr(39), ''))}, "
        f"not {plain(str(c['tag']), _LONGEST_TAG)}"
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


def schema_faults(
    failed: ValidationError, raw: dict[str, Any], model: type[BaseModel], origin: Origin
) -> tuple[list[Fault], int]:
    """The faults of a validation, ``MOST_TOLD`` at most, and how many there are more."""
    found = failed.errors(include_url=False)
    # A misspelt key often shows up as a missing one too: the misspelling is the cause.
    found.sort(key=lambda p: 0 if p["type"] == "extra_forbidden" else 1)
    faults: list[Fault] = []
    for one in found[:MOST_TOLD]:
        parts, field = without_kinds(one["loc"], model)
        key = plain(".".join(_location(parts, raw)), _LONGEST_KEY) or "the scene"
        faults.append(Fault(key, _sentence(dict(one), key, parts, field, model, origin)))
    return faults, max(0, len(found) - MOST_TOLD)


def _sentence(
    fault: dict[str, Any],
    key: str,
    parts: list[int | str],
    field: FieldInfo | None,
    model: type[BaseModel],
    origin: Origin,
) -> str:
    where = origin.of(key)
    kind = fault["type"]
    if kind == "extra_forbidden":
        of_this_kind = known_keys(model, fault["loc"])
        if not is_known(key, of_this_kind) and is_known(key, known_keys(model)):
            return f"{key} {where} does not belong to type {_kind(fault['loc'], parts)}"
        return unknown_key(key, where, of_this_kind)
    if kind == "missing":
        meaning = field.description if field is not None else ""
        return f"{key}{f' ({meaning})' if meaning else ''} is missing {where}"
    wanted = "must be something else"
    if kind in _WANTED:
        wanted = _WANTED[kind](fault.get("ctx") or {})
    value = fault["input"]
    if isinstance(value, dict | BaseModel):
        return f"{key} {where} {wanted}"
    unit = unit_of(key)
    shown_unit = f" [{unit}]" if unit and kind in _OF_A_NUMBER else ""
    guess = ""
    if (
        kind in (*_OF_A_NUMBER, "value_error")
        and isinstance(value, int | float)
        and not isinstance(value, bool)
    ):
        guess = _guess(key, value)
    return f"{key} is {shown(value)} {where}; it {wanted}{shown_unit}{guess}"


def _guess(key: str, value: float) -> str:
    """The usual range of a number that is out of bounds, and which unit it probably has."""
    try:
        guess, usual = unit_guess(key, value), usual_range(key)
    except OverflowError:  # an integer that no float can hold
        return ""
    if guess or usual is None:
        return f"; {guess}" if guess else ""
    unit = unit_of(key)
    return f"; usual are {usual[0]:.12g} to {usual[1]:.12g} {unit}".rstrip()


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


# The end of the sentence on any other option.
ELSEWHERE = (
    "is no PETSc option that a scene may give: solver options with bounded values only; all others "
    "stand on the command line after --"
)
