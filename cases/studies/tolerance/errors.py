"""Errors of an installation: how many there are, and what they make of a scene."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any

import numpy as np

from catenary.base.errors import InputError
from catenary.cases.scene.input.csv_files import file_key_of
from catenary.cases.scene.input.toml_input import REMOVED, value_at
from catenary.cases.scene.keys.keys import list_of
from catenary.cases.scene.keys.units import length_from_mm, unit_of
from catenary.cases.scene.problem import line_of, resolved
from catenary.cases.scene.scene import Scene
from catenary.cases.studies.sweep.variants import check_key, is_number, refuse_idle, share_a_value
from catenary.cases.studies.tolerance.task import (
    DropperErrors,
    ErrorKind,
    HeightErrors,
    KeyErrors,
    TensionErrors,
)

_LENGTHS = "irregularities.dropper_lengths.by_dropper"
_HEIGHTS = "irregularities.contact_wire_height.by_place"
# Errors so many spans before and behind the evaluated stretch no longer move its statistics.
_SPANS_BESIDE = 2
# Normal errors have this share of the tolerance as standard deviation.
_NORMAL = 0.5


@dataclass(frozen=True)
class Group:
    """Errors of one kind on a line.

    Attributes
    ----------
    table : the errors as the task describes them
    names : names of the n errors
    near : (n,) bool, whether each is near the evaluated stretch
    unit : unit of errors and tolerances
    key : of the scene, to which the errors are written
    places : place of each error, as the scene's key takes it; of a number in a list that of its
        entry, from 0
    given : the scene's own value of the key
    file_key : key of the file from which the scene has it, None of none
    """

    table: ErrorKind
    names: Sequence[str]
    near: np.ndarray
    unit: str
    key: str
    places: Sequence[Any]
    given: Any
    file_key: str | None = None

    def values(self, errors: np.ndarray, before: Mapping[str, Any] = {}) -> dict[str, Any]:
        """The scene's key and its value with errors, shape (n,), in their unit, added to what it
        has in ``before``, or else in the scene."""
        found = {self.key: self._value(before.get(self.key, self.given), errors.tolist())}
        return found if self.file_key is None else {self.file_key: REMOVED, **found}

    def _value(self, given: Any, own: Sequence[float]) -> Any:
        if isinstance(self.table, DropperErrors):
            errors = {(int(span), int(number)): error for span, number, error in given}
            for place, error in zip(self.places, own, strict=True):
                errors[place] = errors.get(place, 0.0) + error
            return [[*place, error] for place, error in errors.items()]
        if isinstance(self.table, HeightErrors):
            return [[x, length_from_mm(e)] for x, e in zip(self.places, own, strict=True)]
        if isinstance(self.table, TensionErrors):
            wrong = [
                {"type": "wrong_tension", "wire": wire, "factor": 1.0 + 0.01 * e}
                for wire, e in zip(self.places, own, strict=True)
            ]
            return [*given, *wrong]
        if not self.places:
            return given + own[0]
        found = list(given)
        found[self.places[0]] += own[0]
        return found

    def random(self, random: np.random.Generator, n_samples: int) -> np.ndarray:
        """Errors over their tolerance, shape (``n_samples``, n), all within -1 and 1; ``random``
        makes them."""
        shares = random.uniform(-1.0, 1.0, (n_samples, len(self.names)))
        if self.table.distribution == "uniform":
            return shares
        from scipy.special import ndtr, ndtri

        within = ndtr(1.0 / _NORMAL) - 0.5
        return np.asarray(_NORMAL * ndtri(0.5 + shares * within))


def groups_of(tables: Sequence[ErrorKind], scene: Scene) -> list[Group]:
    """The errors of a task, ``tables``, on the line of a scene. Not collective.

    Raises
    ------
    InputError
        If the line has nothing that an error is of, or heights of its own, or if errors of a kind
        are switched off.
    """
    groups = [_group(table, scene, f"errors.{number}") for number, table in enumerate(tables)]
    groups = [replace(one, file_key=file_key_of(one.key, scene.origin)) for one in groups]
    for number, group in enumerate(groups):
        refuse_idle(group.key, scene, f"errors.{number}")
    for (i, earlier), (j, later) in combinations(enumerate(groups), 2):
        if not share_a_value(earlier.key, later.key):
            continue
        of_entries = earlier.key == later.key and isinstance(later.given, list)
        if of_entries and earlier.places != later.places:
            continue  # entries of one list, each with an error of its own
        raise InputError(
            f"errors.{j} are of {_named(later)}, as errors.{i} are; give one of them"
            if type(earlier.table) is type(later.table)
            else f"errors.{j} change {later.key}, which errors.{i} change, too; give one of them"
        )
    return groups


def _named(group: Group) -> str:
    """What the errors of a group are of."""
    table = group.table
    if not isinstance(table, KeyErrors):
        return table.kind
    return f"{group.key} {group.places[0] + 1}" if group.places else group.key


def _group(table: ErrorKind, scene: Scene, where: str) -> Group:
    line, tables = line_of(scene), resolved(scene)
    masts = line.support_positions
    span = float(np.mean(np.diff(masts)))
    low = min(scene.evaluation.from_m, masts[-1] - scene.evaluation.to_m)
    high = max(scene.evaluation.to_m, masts[-1] - scene.evaluation.from_m)
    low, high = low - _SPANS_BESIDE * span, high + _SPANS_BESIDE * span
    irregular = tables.get("irregularities", {})
    if isinstance(table, DropperErrors):
        droppers = line.numbered_droppers
        if not droppers:
            raise InputError(f"{where} are of dropper lengths, but the line has no droppers")
        places, x = [*droppers], np.array([*droppers.values()])
        names = [f"span {s}, dropper {d}" for s, d in places]
        given = irregular.get("dropper_lengths", {}).get("by_dropper", [])
        return Group(table, names, (x > low) & (x < high), "mm", _LENGTHS, places, given)
    if isinstance(table, HeightErrors):
        if irregular.get("contact_wire_height", {}).get("by_place"):
            raise InputError(f"{where} are heights, but the scene has {_HEIGHTS} of its own")
        names = [f"support {i}" for i in range(masts.size)]
        return Group(
            table, names, (masts > low) & (masts < high), "mm", _HEIGHTS, masts.tolist(), None
        )
    if isinstance(table, TensionErrors):
        known = [wire.name for wire in line.wires]
        for wire in table.wires:
            if wire not in known:
                raise InputError(f"{where}.wires has {wire}, but the line has {', '.join(known)}")
        near = np.ones(len(table.wires), dtype=bool)
        given = tables.get("defects", [])
        return Group(table, table.wires, near, "%", "defects", table.wires, given)
    return _of_key(table, tables, where)


def _of_key(table: KeyErrors, tables: dict[str, Any], where: str) -> Group:
    check_key(table.key, f"in {where}")
    key, entry = table.key, None if table.entry is None else table.entry - 1
    if entry is None and isinstance(value_at(tables, list_of(key)), list):
        key, entry = list_of(key), int(key.rpartition(".")[2]) if list_of(key) != key else None
    value = value_at(tables, key)
    own = value if entry is None else value_at(value, str(entry))
    if not is_number(own):
        at = "" if entry is None else f" at entry {entry + 1}"
        hint = f"; {where}.entry names one of its list" if isinstance(own, list) else ""
        raise InputError(f"{where}.key is {key}, which has no number{at} in the scene{hint}")
    one, places = np.ones(1, dtype=bool), [] if entry is None else [entry]
    return Group(table, [table.key], one, unit_of(key), key, places, value)
