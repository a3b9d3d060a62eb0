"""All keys that a scene knows, and the nearest known one to a misspelt key."""

from __future__ import annotations

import difflib
import types
import typing
from typing import Any

from pydantic import BaseModel

from catenary.cases.table import Table
from catenary.solver import effects

# Stands for an index into a list of tables or for a name that the scene chooses.
ANY = "*"


def known_keys(model: type[BaseModel]) -> list[str]:
    """Dotted keys of a table and of all tables below it, ``*`` for what the scene names."""
    found: list[str] = []
    for name, field in model.model_fields.items():
        found.append(name)
        if name == "effects":
            found += [f"effects.{effect}" for effect in effects.registry()]
            continue
        inner, wildcard = table_in(field.annotation)
        if inner is not None:
            prefix = f"{name}.{ANY}" if wildcard else name
            if wildcard:
                found.append(prefix)
            found += [f"{prefix}.{key}" for key in known_keys(inner)]
        elif _is_free(field.annotation):
            found.append(f"{name}.{ANY}")
    return found


def table_in(annotation: Any) -> tuple[type[Table] | None, bool]:
    """The table class inside an annotation and whether a list or mapping of it is meant."""
    if isinstance(annotation, type) and issubclass(annotation, Table):
        return annotation, False
    origin, arguments = typing.get_origin(annotation), typing.get_args(annotation)
    if origin in (typing.Union, types.UnionType):
        for argument in arguments:
            inner, wildcard = table_in(argument)
            if inner is not None:
                return inner, wildcard
    elif origin in (list, dict) and arguments:
        inner, _ = table_in(arguments[-1])
        return inner, inner is not None
    return None, False


def _is_free(annotation: Any) -> bool:
    return typing.get_origin(annotation) is dict


def is_known(key: str, known: list[str]) -> bool:
    """Whether a dotted key matches one of ``known``."""
    parts = key.split(".")
    return any(_matches(parts, candidate.split(".")) for candidate in known)


def _matches(parts: list[str], pattern: list[str]) -> bool:
    if pattern in (["petsc", ANY], ["test", ANY]):
        return len(parts) >= 2 and parts[0] == pattern[0]  # free tables: names may hold dots
    return len(parts) == len(pattern) and all(
        want in (ANY, part) for part, want in zip(parts, pattern, strict=True)
    )


def nearest(key: str, known: list[str]) -> str | None:
    """The known key that ``key`` most likely stands for, None if nothing comes near.

    In this order: the same last part in another table, a similar one in the same table, a similar
    one anywhere, a similar key as a whole. What the scene itself names is shown as ``<name>``.
    """
    parts = key.split(".")
    named = [candidate for candidate in known if not candidate.endswith(ANY)]
    lasts = [candidate.rsplit(".", 1)[-1] for candidate in named]
    if parts[-1] in lasts:
        return _most_alike(key, named, parts[-1])
    siblings = [
        last
        for candidate, last in zip(named, lasts, strict=True)
        if _matches(parts[:-1], candidate.split(".")[:-1])
    ]
    close = difflib.get_close_matches(parts[-1], siblings, n=1, cutoff=0.6)
    if close:
        return ".".join([*parts[:-1], close[0]])
    close = difflib.get_close_matches(parts[-1], lasts, n=1, cutoff=0.75)
    if close:
        return _most_alike(key, named, close[0])
    close = difflib.get_close_matches(key, named, n=1, cutoff=0.6)
    return close[0].replace(ANY, "<name>") if close else None


def _most_alike(key: str, known: list[str], last: str) -> str:
    candidates = [c for c in known if c.rsplit(".", 1)[-1] == last]
    best = difflib.get_close_matches(key, candidates, n=1, cutoff=0.0)[0]
    return best.replace(ANY, "<name>")
