"""All keys of a scene, the nearest one to a misspelt key, and sentences about wrong ones."""

from __future__ import annotations

import difflib
import functools
import types
import typing
from collections.abc import Callable, Sequence
from typing import Annotated, Any, NamedTuple

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo

from catenary.cases.scene.input.faults import MOST_TOLD, Fault, Origin, shown
from catenary.cases.scene.input.plain_text import plain
from catenary.cases.scene.keys.table import Table
from catenary.cases.scene.keys.units import unit_guess, unit_of, usual_range, without_unit
from catenary.solver.effects import all_effects as effects

# Stands for an index into a list of tables or for a name that the scene chooses.
ANY = "*"
# Tables of a scene that its line, and how that is stepped, do not depend on.
OF_THE_TRAIN = ("case", "train", "pantographs", "contact", "evaluation", "output", "test")
# Characters of a key that a sentence repeats; a longer one is no misspelt one. And of a tag.
_LONGEST, _LONGEST_TAG = 200, 60
# The end of the sentence on an option of PETSc that is no key.
ELSEWHERE = (
    "is no PETSc option that a scene may give: solver options with bounded values only; all others "
    "stand on the command line after --"
)


def known_keys(model: type[BaseModel], location: Sequence[int | str] = ()) -> tuple[str, ...]:
    """Dotted keys of a table and of all tables below it, ``*`` for what the scene names.

    Where there are several kinds of table, the keys of all of them, or only of those that
    ``location``, as pydantic gives it, leads through.
    """
    return _known_keys(model, tuple(location), tuple(effects.registry()))


@functools.cache
def _known_keys(
    model: type[BaseModel], location: tuple[int | str, ...], registered: tuple[str, ...]
) -> tuple[str, ...]:
    """The same, found once for the effects that are ``registered``: studies make many scenes."""
    found: dict[str, None] = {}
    for name, field in model.model_fields.items():
        found[name] = None
        if name == "effects":
            found |= {f"effects.{effect}": None for effect in registered}
            continue
        inner, wildcard = tables_in(field.annotation)
        if inner:
            below = tuple(location[1:]) if location and location[0] == name else ()
            prefix = name
            if wildcard:
                prefix, below = f"{name}.{ANY}", below[1:]
                found[prefix] = None
            if len(inner) > 1 and below:
                chosen = tuple(table for table in inner if kind_of(table) == below[0])
                inner, below = chosen or inner, below[1:] if chosen else below
            for table in inner:
                keys = _known_keys(table, below, registered)
                found |= {f"{prefix}.{key}": None for key in keys}
        elif typing.get_origin(field.annotation) is dict:
            found[f"{name}.{ANY}"] = None
    return tuple(found)


def kind_of(table: type[BaseModel]) -> str:
    """The ``type`` or ``kind`` of a table that is one of several, "" if it has none."""
    field = table.model_fields.get("type", table.model_fields.get("kind"))
    choices = typing.get_args(field.annotation) if field is not None else ()
    return str(choices[0]) if choices else ""


def tables_in(annotation: Any) -> tuple[tuple[type[Table], ...], bool]:
    """The table classes inside an annotation and whether a list or mapping of them is meant."""
    if isinstance(annotation, type) and issubclass(annotation, Table):
        return (annotation,), False
    origin, arguments = typing.get_origin(annotation), typing.get_args(annotation)
    if origin is Annotated:
        return tables_in(arguments[0])
    if origin in (typing.Union, types.UnionType):
        found: tuple[type[Table], ...] = ()
        wildcard = False
        for argument in arguments:
            inner, many = tables_in(argument)
            found, wildcard = found + inner, wildcard or many
        return found, wildcard
    if origin in (list, dict) and arguments:
        inner, _ = tables_in(arguments[-1])
        return inner, bool(inner)
    return (), False


class Place(NamedTuple):
    """Where a key stands among the tables of a scene.

    Attributes
    ----------
    parts : of the dotted key, as far as it leads through what is written
    location : the same with the kinds of tables on the way, as pydantic has them
    field : what it names, None of a number, of a name that the scene chose, or of an unknown key
    kind : of the last table of which there are several kinds, "" if there is none
    """

    parts: list[str]
    location: list[str]
    field: FieldInfo | None
    kind: str


def place_of(key: Sequence[int | str], raw: Any, model: type[BaseModel]) -> Place:
    """The place of a key, given by its parts or as a location of pydantic, in tables ``raw``."""
    parts: list[str] = []
    location: list[str] = []
    here: tuple[type[BaseModel], ...] = (model,)
    field, kind, named = None, "", False  # named: what comes next is a name that the scene chose
    for part in key:
        if len(here) > 1 and not named and isinstance(raw, dict):
            own = raw.get("type", raw.get("kind", kind_of(here[0])))
            if chosen := tuple(table for table in here if kind_of(table) == own):
                here, kind = chosen, str(own)
                location.append(kind)
                if part == kind:
                    continue
        if part == "[key]" or (isinstance(part, int) and not isinstance(raw, list)):
            break  # one number was written where a list may stand
        parts.append(str(part))
        location.append(str(part))
        if isinstance(raw, list):
            raw = raw[int(part)] if str(part).isdecimal() and int(part) < len(raw) else None
        else:
            raw = raw.get(part) if isinstance(raw, dict) else None
        if named:
            named = False
            continue
        fields = [
            table.model_fields[parts[-1]] for table in here if parts[-1] in table.model_fields
        ]
        field = fields[0] if fields else None
        here, named = tables_in(field.annotation) if field is not None else ((), False)
    return Place(parts, location, field, kind)


@functools.lru_cache(maxsize=256)
def is_known(key: str, known: tuple[str, ...]) -> bool:
    """Whether a dotted key matches one of ``known``; studies ask for the same keys again."""
    parts = key.split(".")
    return key in known or any(_matches(parts, candidate.split(".")) for candidate in known)


def list_of(key: str) -> str:
    """The key of the list whose entry a key names by its number; the key itself if it is none."""
    above, _, number = key.rpartition(".")
    return above if above and number.isascii() and number.isdigit() else key


def names_value(key: str, known: tuple[str, ...]) -> bool:
    """Whether a dotted key, or the list whose entry it names by its number, is one of ``known``."""
    return is_known(key, known) or is_known(list_of(key), known)


def _matches(parts: list[str], pattern: list[str]) -> bool:
    if pattern == ["test", ANY]:
        return len(parts) >= 2 and parts[0] == pattern[0]  # a free table: its names hold dots
    return len(parts) == len(pattern) and all(
        want in (ANY, part) for part, want in zip(parts, pattern, strict=True)
    )


def meant(name: str, known: Sequence[str]) -> str:
    """Words for who has given an unknown ``name``: the known one that comes near, or all."""
    near = nearest(name, known)
    return f"did you mean {near}?" if near else f"there are {', '.join(known)}"


def nearest(key: str, known: Sequence[str]) -> str | None:
    """The known key that ``key`` most likely stands for, None if nothing comes near.

    In this order: the same last part in another table, a similar one in the same table, a similar
    one anywhere, a similar key as a whole. What the scene itself names is shown as ``<name>``.
    """
    if len(key) > _LONGEST:
        return None
    parts = key.split(".")
    named = [candidate for candidate in known if not candidate.endswith(ANY)]
    lasts = [candidate.rsplit(".", 1)[-1] for candidate in named]
    if parts[-1] in lasts:
        return _most_alike(key, named, parts[-1])
    siblings = {
        written: last
        for candidate, last in zip(named, lasts, strict=True)
        if _matches(parts[:-1], candidate.split(".")[:-1])
        for written in (last, without_unit(last))
    }
    close = difflib.get_close_matches(parts[-1], siblings, n=1, cutoff=0.6)
    if close:
        return ".".join([*parts[:-1], siblings[close[0]]])
    close = difflib.get_close_matches(parts[-1], lasts, n=1, cutoff=0.75)
    if close:
        return _most_alike(key, named, close[0])
    for similar in difflib.get_close_matches(key, named, n=1, cutoff=0.6):
        below = f"{similar}."
        if key.startswith(below) and any(one.startswith(below) for one in known):
            return None  # the table in which the key was written
        return similar.replace(ANY, "<name>")
    return None


def _most_alike(key: str, known: list[str], last: str) -> str:
    candidates = [c for c in known if c.rsplit(".", 1)[-1] == last]
    # A key of a table below the one that is named: the first, which most scenes have.
    below = [c for c in candidates if c.startswith(key.removesuffix(last))]
    if below and key != last:
        return below[0].replace(ANY, "<name>")
    best = difflib.get_close_matches(key, candidates, n=1, cutoff=0.0)[0]
    return best.replace(ANY, "<name>")


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
        place = place_of(one["loc"], raw, model)
        key = plain(".".join(place.parts), _LONGEST) or "the scene"
        faults.append(Fault(key, _sentence(dict(one), key, place, model, origin)))
    return faults, max(0, len(found) - MOST_TOLD)


def _sentence(
    fault: dict[str, Any], key: str, place: Place, model: type[BaseModel], origin: Origin
) -> str:
    where = origin.of(key)
    kind = fault["type"]
    if kind == "extra_forbidden":
        of_this_kind = known_keys(model, place.location)
        if not is_known(key, of_this_kind) and is_known(key, known_keys(model)):
            return f"{key} {where} does not belong to type {place.kind}"
        return unknown_key(key, where, of_this_kind)
    if kind == "missing":
        meaning = place.field.description if place.field is not None else ""
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
