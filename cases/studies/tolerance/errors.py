"""Errors of an installation: the task that names them, what they make of a scene, their samples.

The task is what FILE.toml may hold. Samples of an error are run at several levels of it: they have
margins to each criterion, and some of them keep it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
from pydantic import Field, model_validator

from catenary.base.errors import InputError
from catenary.cases.scene.input.case_files import REMOVED, value_at
from catenary.cases.scene.input.csv_files import file_key_of
from catenary.cases.scene.keys.keys import list_of
from catenary.cases.scene.keys.table import Table
from catenary.cases.scene.keys.units import length_from_mm, unit_of
from catenary.cases.scene.line.imperfections import Seed, WireName
from catenary.cases.scene.scene import Scene, line_of, resolved
from catenary.cases.studies.scene_sets import BoundTable, SetTable, refuse_contradictions
from catenary.cases.studies.sweep.variants import check_key, is_number, refuse_idle, share_a_value

Label = Annotated[str, Field(min_length=1, max_length=100)]
_LENGTHS = "irregularities.dropper_lengths.by_dropper"
_HEIGHTS = "irregularities.contact_wire_height.by_place"
# Errors so many spans before and behind the evaluated stretch no longer move its statistics.
_SPANS_BESIDE = 2
# Normal errors have this share of the tolerance as standard deviation.
_NORMAL = 0.5


class ErrorTable(Table):
    """An error of the installation that may be as large as its tolerance, up and down."""

    name: Label = Field(description="what people call it")
    level: float = Field(
        gt=0, description="tolerance from which all together are scaled, in the error's unit"
    )
    most: float = Field(gt=0, description="greatest tolerance that is looked at, in the same unit")
    distribution: Literal["uniform", "normal"] = Field(
        "uniform",
        description="errors evenly within the tolerance, or normal ones with half of it as "
        "standard deviation, cut off at the tolerance",
    )


class DropperErrors(ErrorTable):
    """Each dropper is cut too long or too short [mm]."""

    kind: Literal["dropper_lengths"] = Field(description="kind of error")


class HeightErrors(ErrorTable):
    """The contact wire hangs too high or too low at each support, droppers are cut for it [mm]."""

    kind: Literal["contact_wire_height"] = Field(description="kind of error")


class TensionErrors(ErrorTable):
    """Wires have another tension than the one for which droppers were cut [%]."""

    kind: Literal["tension"] = Field(description="kind of error")
    wires: list[WireName] = Field(
        ["contact_wire", "messenger_wire"],
        min_length=1,
        max_length=20,
        description="names of the wires, each with an error of its own",
    )


class KeyErrors(ErrorTable):
    """A number of the scene is another one, for which droppers are cut [unit of the key]."""

    kind: Literal["key"] = Field(description="kind of error")
    key: str = Field(min_length=1, max_length=200, description="dotted key of the scene")
    entry: Annotated[int, Field(ge=1, le=10_000)] | None = Field(
        None, description="of a list, the number of its entry, from 1"
    )


ErrorKind = Annotated[
    DropperErrors | HeightErrors | TensionErrors | KeyErrors, Field(discriminator="kind")
]


class SamplesTable(Table):
    """Search for tolerances."""

    probability: float = Field(
        0.99, gt=0.5, lt=1, description="share of the installed lines that keep a criterion"
    )
    confidence: float = Field(
        0.95, ge=0.5, lt=1, description="with which the samples show that share"
    )
    number: int | None = Field(
        None,
        ge=2,
        le=100_000,
        description="random lines at each level; if absent the fewest that show the share if all "
        "keep the criterion, 299 for 99 % at 95 % confidence",
    )
    seed: Seed = Field(1, description="of the errors, the same at all levels")
    resolution: float = Field(
        0.04, gt=0.001, le=0.5, description="of a tolerance, as a share of the greatest"
    )
    worst_case: bool = Field(
        True, description="also the worst case, by slopes of all errors near the evaluated stretch"
    )

    @model_validator(mode="after")
    def _enough(self) -> SamplesTable:
        if self.number is not None and self.number < self.fewest:
            raise ValueError(
                f"must have number = {self.fewest} at least, which show "
                f"{100 * self.probability:g} % at {100 * self.confidence:g} % confidence if none "
                f"fails, but has {self.number}"
            )
        return self

    @property
    def fewest(self) -> int:
        """Samples that show the share if none fails: p^n is at most 1 - confidence."""
        return max(2, math.ceil(math.log(1.0 - self.confidence) / math.log(self.probability)))

    @property
    def n(self) -> int:
        """Number of random lines."""
        return self.number or self.fewest

    @property
    def allowed(self) -> int:
        """Number of samples that may fail: the most whose lower bound of Clopper and Pearson is
        not below the share."""
        from scipy.stats import binom

        failures = np.arange(self.n)
        shown = binom.cdf(failures, self.n, 1.0 - self.probability) <= 1.0 - self.confidence
        return int(np.count_nonzero(shown)) - 1


class ToleranceTask(Table):
    """Errors, criteria and the scenes over which these must be kept."""

    set: SetTable = Field(default_factory=SetTable, description="the scenes")
    errors: list[ErrorKind] = Field(min_length=1, max_length=20, description="what may be off")
    criteria: list[BoundTable] = Field(
        default_factory=list,
        max_length=50,
        description="what every run must keep; the acceptance criteria of the case if absent",
    )
    samples: SamplesTable = Field(default_factory=SamplesTable, description="the samples")

    @model_validator(mode="after")
    def _differ(self) -> ToleranceTask:
        names = [one.name for one in self.errors]
        if len(set(names)) < len(names):
            raise ValueError("must give each of the errors a name of its own")
        refuse_contradictions(self.criteria, "criteria")
        return self


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


class Bound(NamedTuple):
    """Bound of a criterion.

    Attributes
    ----------
    limit : in the criterion's unit
    is_least : whether values must be at least that, not at most
    meaning : of the values, with their unit, for axes of pictures
    """

    limit: float
    is_least: bool
    meaning: str

    def margin(self, value: float) -> float:
        """Distance of a value from the limit, negative beyond."""
        return value - self.limit if self.is_least else self.limit - value

    def values(self, margins: np.ndarray) -> np.ndarray:
        """Values with these margins to the limit."""
        return self.limit + (margins if self.is_least else -margins)


@dataclass(frozen=True)
class Samples:
    """Samples of an error under a criterion, the same random numbers at each level.

    A level at which too many fail is left early, those first that failed at another one. The share
    of the lines run there says nothing; but a line that is not run at a level has kept the
    criterion at a greater one, or lost it at a smaller one, or is not known there. Bisection takes
    the same for granted.

    Attributes
    ----------
    levels : (m,) ascending, from 0, in the error's unit
    margins : (m, n) of n samples, the least of all runs of a line: negative where it loses the
        criterion, minus infinity if a run broke, NaN where it was not run; of several criteria the
        sign alone counts
    """

    levels: np.ndarray
    margins: np.ndarray

    @property
    def n_run(self) -> np.ndarray:
        """Number of samples run at each level, shape (m,)."""
        return np.count_nonzero(~np.isnan(self.margins), axis=1)

    @property
    def n_kept(self) -> tuple[np.ndarray, np.ndarray]:
        """Fewest and most samples that keep the criterion at each level, both of shape (m,)."""
        unknown = np.isnan(self.margins)
        kept, lost = self.margins >= 0.0, self.margins < 0.0
        above = np.logical_or.accumulate(kept[::-1])[::-1]
        below = np.logical_or.accumulate(lost)
        kept |= unknown & above & ~below
        lost |= unknown & below & ~above
        return kept.sum(axis=1), self.margins.shape[1] - lost.sum(axis=1)

    def records(self) -> list[dict[str, Any]]:
        """A row for each level: samples run, and those that keep the criterion."""
        columns = zip(self.levels, self.n_run, *self.n_kept, strict=True)
        return [
            {"level": float(a), "n_run": int(b), "kept_at_least": int(c), "kept_at_most": int(d)}
            for a, b, c, d in columns
        ]


def least_share(kept: int, n: int, confidence: float) -> float:
    """Lower bound of the share of all lines that keep a criterion which ``kept`` of n samples keep
    (C. Clopper, E. Pearson, Biometrika 26, 1934)."""
    from scipy.stats import binomtest

    found = binomtest(kept, n, alternative="greater")
    return float(found.proportion_ci(confidence, method="exact").low)


def samples_of(levels: Sequence[float], margins: Sequence[Sequence[float]]) -> Samples:
    """Samples of levels in any order, with the margins of each."""
    order = np.argsort(levels)
    return Samples(np.array(levels)[order], np.array(margins)[order])
