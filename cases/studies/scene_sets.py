"""Sets of scenes of one case, evaluated together: directions, speeds, trains, errors."""

from __future__ import annotations

import itertools
import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple

import numpy as np
from pydantic import AfterValidator, Field, field_validator, model_validator

from catenary.base.errors import InputError
from catenary.cases.process.interrupts import Interrupted
from catenary.cases.process.workers import Pool, cores, in_order
from catenary.cases.scene.input.case_files import parse_assignment
from catenary.cases.scene.keys.table import Table
from catenary.cases.scene.line.imperfections import Seed
from catenary.cases.scene.load import Draft
from catenary.cases.scene.scene import Scene, resolved
from catenary.cases.scene.turned import FORWARD, turned
from catenary.cases.studies.records import KeptRows
from catenary.cases.studies.sweep.jobs import OF_LINE, STATISTICS, statistics_of
from catenary.cases.studies.sweep.variants import refuse_idle, sets_again, share_a_value

if TYPE_CHECKING:
    from catenary.cases.studies.ensemble import Marches

Direction = Literal["forward", "backward"]
MOST_SCENES = 1000
_LENGTHS = "irregularities.dropper_lengths"
_WHERE = "in the set of scenes"


def _is_statistic(name: str) -> str:
    if name not in STATISTICS:
        raise ValueError(f"must be one of {', '.join(STATISTICS)}")
    return name


Statistic = Annotated[str, AfterValidator(_is_statistic)]


class BoundTable(Table):
    """Bound that every pantograph of every scene must keep."""

    statistic: Statistic = Field(description="statistic of a run")
    at_least: float | None = Field(None, description="least value allowed")
    at_most: float | None = Field(None, description="greatest value allowed")

    @model_validator(mode="after")
    def _bounded(self) -> BoundTable:
        if (self.at_least is None) == (self.at_most is None):
            raise ValueError("needs at_least or at_most, one of both")
        return self

    @property
    def text(self) -> str:
        """The bound in words."""
        if self.at_least is not None:
            return f"{self.statistic} >= {self.at_least:g}"
        return f"{self.statistic} <= {self.at_most:g}"

    @property
    def limit(self) -> float:
        """The least or the greatest value allowed."""
        limit = self.at_most if self.at_least is None else self.at_least
        assert limit is not None
        return limit

    @property
    def scale(self) -> float:
        """Scale of margins: the absolute bound, or 100 if that is smaller than 1."""
        return abs(self.limit) if abs(self.limit) >= 1.0 else 100.0


# Statistics of a run none of which is greater than the next one, and least and greatest values of
# those that have some.
_ASCENDING = (
    ("min_N", "mean_N", "max_N"),
    ("stat_min_N", "mean_N", "stat_max_N"),
    ("min_dropper_force_N", "max_dropper_force_N"),
)
_POSSIBLE = {
    **dict.fromkeys(("std_N", "std_0_5_N", "std_5_20_N", "n_slackened"), (0.0, np.inf)),
    "loss_percent": (0.0, 100.0),
}


def refuse_contradictions(
    bounds: Sequence[BoundTable], name: str, are_shares: bool = False
) -> None:
    """Raise ValueError if no run can keep all ``bounds``, which are called ``name`` in the task.

    ``are_shares`` says that they bound shares of a run's own values, in place of values.
    """
    of_whom = " of the value as shipped" if are_shares else ""
    for one in bounds:
        least, most = _POSSIBLE.get(one.statistic, (-np.inf, np.inf))
        if are_shares:
            most = np.inf
        if one.limit < least if one.at_least is None else one.limit > most:
            raise ValueError(
                f"must have {name} that a run can keep, but has {one.text}{of_whom}: "
                f"{one.statistic} is {least:g}"
                + (" at least" if one.at_least is None else f" to {most:g}")
            )
    lower = [one for one in bounds if one.at_least is not None]
    upper = [one for one in bounds if one.at_least is None]
    for least_one, most_one in itertools.product(lower, upper):
        pair = least_one.statistic, most_one.statistic
        ordered = not are_shares and any(
            pair in itertools.combinations(names, 2) for names in _ASCENDING
        )
        if (pair[0] == pair[1] or ordered) and least_one.limit > most_one.limit:
            raise ValueError(
                f"must have {name} that a run can keep together, but {least_one.text} and "
                f"{most_one.text}{of_whom} contradict each other"
            )


class ErrorSamples(Table):
    """Lines whose droppers are cut with random errors, beside the one without."""

    dropper_lengths_mm: float = Field(
        gt=0, le=200, description="standard deviation of the errors of dropper lengths"
    )
    seeds: list[Seed] = Field(
        min_length=1, max_length=1000, description="one line with errors for each"
    )


class SetTable(Table):
    """The scenes of a study: all combinations of what is given."""

    directions: list[Direction] = Field(
        ["forward", "backward"], min_length=1, max_length=2, description="forward, backward"
    )
    speeds_km_h: list[Annotated[float, Field(ge=1, le=1000)]] | None = Field(
        None, min_length=1, max_length=100, description="train speeds; the case's if absent"
    )
    trains: dict[str, list[str]] = Field(
        default_factory=dict,
        max_length=100,
        description="trains by name, each a list of key=value; the case's train if absent",
    )
    errors: ErrorSamples | None = Field(None, description="samples of installation errors")

    @field_validator("directions")
    @classmethod
    def _differ(cls, given: list[str]) -> list[str]:
        if len(set(given)) < len(given):
            raise ValueError("must name a direction once")
        return given

    @property
    def seeds(self) -> Sequence[int | None]:
        """Seeds of the samples; None stands for the line without errors, which comes first."""
        return [None] if self.errors is None else [None, *self.errors.seeds]


class Member(NamedTuple):
    """A scene of a set: in what it differs from the case.

    Attributes
    ----------
    direction : "forward" or "backward"
    speed : [km/h], None for that of the case
    train : name, empty for that of the case
    seed : of the errors, None without errors
    values : pairs of dotted key and value, which the case's values give way to
    """

    direction: str
    speed: float | None
    train: str
    seed: int | None
    values: tuple[tuple[str, Any], ...]

    @property
    def name(self) -> str:
        """Distinguishing label: direction, and speed, train and seed as far as they are given."""
        parts = [self.direction]
        parts += [] if self.speed is None else [f"{self.speed:g} km/h"]
        parts += [self.train] if self.train else []
        parts += [] if self.seed is None else [f"seed {self.seed}"]
        return ", ".join(parts)


def members_of(table: SetTable) -> list[Member]:
    """All scenes of a set.

    Raises
    ------
    InputError
        If there are more than ``MOST_SCENES``, or an assignment of a train is none, or is lost.
    """
    trains = {
        name: [parse_assignment(text, f"train {name}:") for text in texts]
        for name, texts in (table.trains or {"": []}).items()
    }
    speeds: Sequence[float | None] = table.speeds_km_h or [None]
    combined = itertools.product(table.directions, speeds, trains, table.seeds)
    found = []
    for direction, speed, train, seed in combined:
        own: list[tuple[str, Any]] = [] if speed is None else [("train.speed_km_h", speed)]
        if table.errors is not None and seed is not None:
            own.append((f"{_LENGTHS}.standard_deviation_mm", table.errors.dropper_lengths_mm))
            own.append((f"{_LENGTHS}.seed", seed))
        for (later, _), (earlier, _) in itertools.product(own, trains[train]):
            if sets_again(later, earlier):
                raise InputError(
                    f"train {train} of the set gives {earlier}, and the set {later}, by which the "
                    "former would be lost; leave one of them out"
                )
        found.append(Member(direction, speed, train, seed, (*trains[train], *own)))
    if len(found) > MOST_SCENES:
        raise InputError(f"the set has {len(found)} scenes; at most {MOST_SCENES} are allowed")
    return found


@dataclass(frozen=True)
class SceneSet:
    """A case and the members that are made of it.

    Attributes
    ----------
    draft : the case
    members : at least one
    """

    draft: Draft
    members: Sequence[Member]

    def scene(self, member: Member, values: Mapping[str, Any] | None = None) -> Scene:
        """The scene of a member, with further values by dotted keys, which win. Not collective.

        Raises
        ------
        InputError
            If it is wrong, or cannot be run in its direction.
        """
        own: Iterable[tuple[str, Any]] = (*member.values, *(values or {}).items())
        scene = self.draft.assigned((key, value, _WHERE) for key, value in own).scene()
        return scene if member.direction == FORWARD else turned(scene)

    def checked(self) -> SceneSet:
        """This set, all scenes of which can be made as the case has them.

        Raises
        ------
        InputError
            With the name of the member whose scene is wrong, or has no errors of dropper lengths.
        """
        for member in self.members:
            try:
                scene = self.scene(member)
                if member.seed is not None:
                    refuse_idle(_LENGTHS, scene, "set.errors")
            except InputError as error:
                raise InputError(f"scene {member.name}: {error}") from error
        return self


def refuse_shared(members: Sequence[Member], key: str, where: str) -> None:
    """Refuse a key that a study varies and a set gives as well: the set's value would be lost.

    Parameters
    ----------
    members : of the set
    key : dotted key that is varied
    where : the place in the task that names it

    Raises
    ------
    InputError
        If a member has a value of its own there, above or below.
    """
    for member in members:
        for given, _ in member.values:
            if share_a_value(given, key):
                raise InputError(
                    f"{where} varies {key}, but the scene {member.name} of the set has its own "
                    f"{given}, which would be lost; leave one of them out"
                )


BROKE = "broke"
# Tables of a scene that its figures do not depend on.
_IDLE = ("case", "output", "test")


def evaluate(scenes: Sequence[Scene], pool: Pool[Any] | None = None) -> list[dict[str, Any]]:
    """The summary of each scene's run, in their order. Not collective.

    Parameters
    ----------
    scenes : as many as there are to be run: those that share a line march side by side, and those
        that follow each other are marched by one process
    pool : processes that share the runs, as ``workers`` gives them; this process if None

    Returns
    -------
    list of dict
        The ``short_summary`` of each; ``{"broke": sentence}`` of a run that ended early, or of a
        line that cannot hang.

    Raises
    ------
    Interrupted
        If a signal came to several processes.
    """
    if pool is None:
        return _summaries(scenes)
    found: dict[int, dict[str, Any]] = {}
    pieces = pieces_of(scenes, pool.n)
    outcomes = in_order(pool.of([[scenes[number] for number in piece] for piece in pieces]))
    for outcome in outcomes:
        found.update(zip(pieces[outcome.number], outcome.get(), strict=True))
    if len(found) < len(scenes):
        raise Interrupted("the study was interrupted; the same command continues it")
    return [found[number] for number in range(len(scenes))]


def pieces_of(scenes: Sequence[Scene], n: int) -> list[list[int]]:
    """Numbers of scenes in pieces for ``n`` processes, no larger than need be.

    Scenes of one line that are alone in a piece are alone in all: they march by themselves, and
    others side by side, however many processes there are.
    """
    from catenary.cases.studies.ensemble import key_of_line

    lines: dict[str, list[int]] = {}
    for number, scene in enumerate(scenes):
        lines.setdefault(key_of_line(scene), []).append(number)
    size = max(1, -(-len(scenes) // n))
    pieces: list[list[int]] = []
    for line in lines.values():
        while line:
            if not pieces or len(pieces[-1]) >= size:
                pieces.append([])
            n_next = size - len(pieces[-1])
            if len(line) > 1:  # two at least, and no single one is left
                n_next = max(2, n_next)
                n_next += len(line) - n_next == 1
            pieces[-1] += line[:n_next]
            line = line[n_next:]
    return pieces


@contextmanager
def workers(n: int) -> Iterator[Pool[Any] | None]:
    """``n`` processes for ``evaluate``, 0 for one on each core; None for one. Not collective."""
    n = n or cores()
    if n == 1:
        yield None
        return
    with Pool(n, _summaries) as pool:
        yield pool


# Keeps the line of the latest scenes for those to come.
_marches: Marches | None = None


def _summaries(scenes: Sequence[Scene], comm: Any = None) -> list[dict[str, Any]]:
    from catenary.base.process import alone
    from catenary.cases.process.petsc_options import options_of

    alone()  # starts MPI as one process, before anything imports it
    from catenary.cases.studies.ensemble import Marches
    from catenary.postproc.files.run_schema import DONE

    global _marches
    found: list[dict[str, Any]] = [{} for _ in scenes]
    if not scenes:
        return found
    with options_of(scenes[0].petsc.given()):
        _marches = _marches or Marches()
        for one in _marches.of(scenes):
            found[one.number] = one.summary() if one.outcome == DONE else {BROKE: one.outcome}
    return found


def values_of(summary: Mapping[str, Any], statistic: str) -> list[float] | None:
    """A statistic of every pantograph of a run, or the only one of its line.

    None if the run broke, or has no such statistic.

    Parameters
    ----------
    summary : of the run, as ``evaluate`` gives it
    statistic : one of ``STATISTICS`` of the tables of sweeps
    """
    if BROKE in summary:
        return None
    found = [row[statistic] for row in statistics_of(summary)]
    if STATISTICS[statistic] in OF_LINE:
        found = found[:1]
    return None if None in found else [float(value) for value in found]


Wanted = tuple[SceneSet, Member, Mapping[str, Any]]


class Evaluation:
    """Summaries of scenes, each run made once, and kept. Not collective.

    Parameters
    ----------
    pool : processes that share the runs, None for this one
    kept : where summaries are kept from one process to the next
    """

    def __init__(
        self,
        pool: Pool[Any] | None = None,
        kept: KeptRows | None = None,
    ) -> None:
        self._pool = pool
        self._kept = KeptRows(None) if kept is None else kept
        self._known: dict[str, dict[str, Any]] = {}
        #: Runs that were made or kept, each once.
        self.n_runs = 0

    def of(self, wanted: Sequence[Wanted]) -> list[dict[str, Any]]:
        """The summary of each wanted scene, run together unless it is known.

        Parameters
        ----------
        wanted : set, member of it and further values by dotted keys, for each scene

        Returns
        -------
        list of dict
            As ``evaluate`` gives them; a scene that cannot be made broke, too.
        """
        keys, new = [], {}
        for scenes, member, values in wanted:
            try:
                scene = scenes.scene(member, values)
            except InputError as error:
                key = f"{BROKE}: {error}"
                self._known[key] = {BROKE: str(error)}
            else:
                key = identity(scene)
                if key not in self._known and key not in new:
                    new[key] = scene
            keys.append(key)
        self._run(new)
        return [self._known[key] for key in keys]

    def _run(self, new: dict[str, Scene]) -> None:
        self.n_runs += len(new)  # those kept too, so that a study ends the same that was stopped
        for key in list(new):
            if (kept := self._kept.get(key)) is not None:
                self._known[key] = kept
                del new[key]
        if not new:
            return
        for key, summary in zip(new, evaluate(list(new.values()), self._pool), strict=True):
            self._known[key] = summary
            self._kept.keep(key, summary)


def identity(scene: Scene) -> str:
    """A text that two scenes share if their figures are the same."""
    tables = resolved(scene)
    return json.dumps({k: v for k, v in tables.items() if k not in _IDLE}, sort_keys=True)
