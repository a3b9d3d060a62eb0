"""Samples as variants of a case: assignments of the values that a sampling file says."""

from __future__ import annotations

from typing import Any

import numpy as np

from catenary.base.errors import InputError
from catenary.cases.scene.input.csv_files import file_key_of
from catenary.cases.scene.input.toml_input import value_at
from catenary.cases.scene.keys.keys import list_of
from catenary.cases.scene.problem import resolved
from catenary.cases.scene.scene import Scene
from catenary.cases.studies.sampling.design import points
from catenary.cases.studies.sampling.distributions import (
    ChoicesTable,
    DistributionTable,
    SeedTable,
    chosen,
    inverse,
    seeds,
    takes_mean,
)
from catenary.cases.studies.sampling.fields import fields_as_text
from catenary.cases.studies.sampling.tables import SamplingTable, field_column
from catenary.cases.studies.sweep.variants import (
    Variant,
    is_number,
    refuse_idle,
    share_a_value,
    text_of,
)


def sample_name(number: int) -> str:
    """The variant of a sample, by its number from 1: the same, however many samples there are."""
    return f"sample_{number:06d}"


def samples(sampling: SamplingTable, scene: Scene, file: str) -> list[Variant]:
    """The variants of a sampling, in the order of its design. Not collective.

    Parameters
    ----------
    sampling : the checked sampling file
    scene : the scene that is varied, for values and places of its own
    file : where the sampling was written, for sentences

    Raises
    ------
    InputError
        If a key has no value of its own that stands for a missing mean, or takes no field, or if a
        key sets another one again or changes nothing.
    """
    cube = points(sampling)
    where = f"in {file}"
    own = resolved(scene)
    _refuse_lost(sampling, own, where)
    if not any(key.startswith("effects.") for key in sampling.keys):
        for key in (*sampling.keys, *sampling.fields):
            refuse_idle(key, scene, f"{key} {where}")
    columns: dict[str, list[str]] = {}  # of the table
    assigned: list[list[str]] = []  # a list of assignments for each key of the scene
    lists: dict[str, dict[int, list[str]]] = {}  # entries that vary, by the keys of their lists
    for key, table, column in zip(
        sampling.keys, sampling.keys.values(), cube.T[: len(sampling.keys)], strict=True
    ):
        texts = _texts(key, table, column, own, where)
        columns[key] = texts
        above = list_of(key)
        if above == key or not _is_plain_list(value_at(own, above)):
            assigned.append([f"{key}={text}" for text in texts])
        else:
            lists.setdefault(above, {})[int(key.rpartition(".")[2])] = texts
    for key in (*lists, *sampling.fields):
        if named := file_key_of(key, scene.origin):  # its numbers are part of the samples' own
            assigned.append([f"{named}="] * len(cube))
            if key == "line.span_m":  # the file may say how many there are
                assigned.append([f"line.n_spans={scene.line.n_spans}"] * len(cube))
    for key, entries in lists.items():
        assigned.append(_assigned_lists(key, value_at(own, key), entries, len(cube), where))
    for key, field, column in zip(
        sampling.fields, sampling.fields.values(), cube.T[len(sampling.keys) :], strict=True
    ):
        numbers = seeds(column)
        varied = (*sampling.keys, *(other for other in sampling.fields if other != key))
        texts = fields_as_text(key, field, scene, varied, sampling.seed, numbers, where)
        columns[field_column(key)] = [str(number) for number in numbers]
        assigned.append([f"{key}={text}" for text in texts])
    names = list(columns)
    return [
        Variant(
            sample_name(number), assignments, dict(zip(names, values, strict=True)), where=where
        )
        for number, (assignments, values) in enumerate(
            zip(zip(*assigned, strict=True), zip(*columns.values(), strict=True), strict=True), 1
        )
    ]


def _refuse_lost(sampling: SamplingTable, own: dict[str, Any], where: str) -> None:
    """Refuse a key whose value another one sets again, in a scene with the tables ``own``."""
    keys = [*sampling.keys, *sampling.fields]
    for number, later in enumerate(keys):
        for earlier in keys[:number]:
            if not share_a_value(earlier, later):
                continue
            # A part may be set after its table; an entry is set together with its list.
            is_part = later.count(".") > earlier.count(".") and not _is_plain_list(
                value_at(own, earlier)
            )
            if not is_part:
                raise InputError(
                    f"{later} {where} sets the value of {earlier} again, so that one of both would "
                    "be lost; keep one of them"
                )


def _texts(
    key: str, table: DistributionTable, column: np.ndarray, own: dict[str, Any], where: str
) -> list[str]:
    """The values of a key as texts of TOML, from probabilities."""
    if isinstance(table, SeedTable):
        return [str(number) for number in seeds(column)]
    if isinstance(table, ChoicesTable):
        texts = [text_of(value) for value in table.values]
        return [texts[number] for number in chosen(table, column)]
    try:
        mean = _own_number(key, own) if takes_mean(table) else None
        values = inverse(table, mean)(column)
    except ValueError as error:
        raise InputError(f"keys.{key} {where} {error}") from error
    return [repr(value) for value in values.tolist()]


def _assigned_lists(
    key: str, own: list[Any], entries: dict[int, list[str]], n: int, where: str
) -> list[str]:
    """Assignments of a list some entries of which vary; the others are the scene's own."""
    if max(entries) >= len(own):
        raise InputError(
            f"keys.{key}.{max(entries)} {where} is unknown: the list has {len(own)} entries, "
            "numbered from 0"
        )
    texts = [entries.get(i, [text_of(value)] * n) for i, value in enumerate(own)]
    return [f"{key}=[{', '.join(one)}]" for one in zip(*texts, strict=True)]


def _is_plain_list(value: Any) -> bool:
    """Whether a value is a list of numbers or texts."""
    return isinstance(value, list) and not any(isinstance(one, dict | list) for one in value)


def _own_number(key: str, own: dict[str, Any]) -> float:
    """The scene's own value of a dotted key; ValueError if it has none, with a predicate."""
    here = value_at(own, key)
    if isinstance(here, list) and len(here) == 1:  # one number may be written for a list
        (here,) = here
    if not is_number(here):
        raise ValueError("needs a mean: the scene has no number of its own there")
    return float(here)
