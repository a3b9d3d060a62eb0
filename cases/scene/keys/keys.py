"""All keys of a scene, and the nearest one to a misspelt key."""

from __future__ import annotations

import difflib
import functools
import types
import typing
from collections.abc import Sequence
from typing import Annotated, Any

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from catenary.cases.scene.keys.table import Table
from catenary.cases.scene.keys.units import without_unit
from catenary.solver.effects import all_effects as effects

# Stands for an index into a list of tables or for a name that the scene chooses.
ANY = "*"
# Tables of a scene that its line, and how that is stepped, do not depend on.
OF_THE_TRAIN = ("case", "train", "pantographs", "contact", "evaluation", "output", "test")
# A longer key is no misspelt one.
_LONGEST = 200


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


def with_kinds(key: str, raw: Any, model: type[BaseModel]) -> list[str]:
    """A dotted key as pydantic's location, with the kinds of tables that ``raw`` says there are."""
    location: list[str] = []
    here: tuple[type[BaseModel], ...] = (model,)
    named = choosing = False
    for part in key.split("."):
        if choosing and not named:
            choosing = False
            kind = raw.get("type", kind_of(here[0])) if isinstance(raw, dict) else ""
            chosen = tuple(table for table in here if kind_of(table) == kind)
            if chosen:
                here = chosen
                location.append(str(kind))
        location.append(part)
        raw = raw.get(part) if isinstance(raw, dict) else None
        if named:
            named = False
            continue
        fields = [table.model_fields[part] for table in here if part in table.model_fields]
        here, named = tables_in(fields[0].annotation) if fields else ((), False)
        choosing = len(here) > 1
    return location


def without_kinds(
    location: Sequence[int | str], model: type[BaseModel]
) -> tuple[list[int | str], FieldInfo | None]:
    """A location of pydantic without the kinds of tables in it, and the field where it ends."""
    parts: list[int | str] = []
    here: tuple[type[BaseModel], ...] = (model,)
    field: FieldInfo | None = None
    named = choosing = False  # what comes next is a name that the scene chose, or a kind
    for part in location:
        if choosing and not named:
            choosing = False
            chosen = tuple(table for table in here if kind_of(table) == part)
            if chosen:
                here = chosen
                continue
        parts.append(part)
        if named:
            named = False
            continue
        field = next(
            (table.model_fields[str(part)] for table in here if str(part) in table.model_fields),
            None,
        )
        here, named = tables_in(field.annotation) if field is not None else ((), False)
        choosing = len(here) > 1
    return parts, field


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
