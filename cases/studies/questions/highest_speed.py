"""Highest speed at which acceptance criteria hold: an ensemble over speeds, then bisection.

Criteria are not monotonic in speed: mean-force limits are also missed at low speeds, and resonances
of the line make stretches of speeds between which a criterion fails. The search therefore keeps all
stretches that the first, even division shows, and bisects each of their ends.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from math import ceil
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure

from catenary.base.errors import InputError
from catenary.cases.scene.input.faults import shown
from catenary.cases.studies.sweep.jobs import STATISTICS, Ended
from catenary.cases.studies.sweep.output import remarks_of, table_of
from catenary.cases.studies.sweep.together import Marching
from catenary.cases.studies.sweep.variants import VariedKey, product
from catenary.postproc.report.pictures import figures
from catenary.postproc.report.study_table import Column, Row, StudyTable, write_files

KEY = "train.speed_km_h"
ALL = "all criteria"
TABLE, RUNS, RECORD, PICTURE = "speed.csv", "speeds.csv", "speed.json", "speed.png"
# Statistic of a panel, and the criteria whose limits stand in it.
_PANELS = (
    ("std_N", "standard deviation"),
    ("max_N", "maximum contact force"),
    ("min_N", "minimum contact force"),
    ("max_uplift_mm", "contact-wire uplift"),
)
# Speeds of the first division at most, and the bounds of a scene's speed [km/h].
MOST, _SLOWEST, _FASTEST = 2000, 1.0, 1000.0


class Speeds(NamedTuple):
    """Which speeds are marched, all [km/h].

    Attributes
    ----------
    slowest, fastest : ends of the range
    step : distance of the first speeds
    within : how closely ends of stretches are bisected
    """

    slowest: float = 200.0
    fastest: float = 360.0
    step: float = 10.0
    within: float = 1.0

    def first(self) -> list[float]:
        """The even division, both ends in it.

        Raises
        ------
        InputError
            If the range is none, or the division too fine.
        """
        if not _SLOWEST <= self.slowest < self.fastest <= _FASTEST:
            raise InputError(
                f"--from {self.slowest:g} --to {self.fastest:g} is no range of speeds: give two "
                f"ascending speeds from {_SLOWEST:g} to {_FASTEST:g} km/h"
            )
        if not 0.0 < self.within <= self.step:
            raise InputError(
                f"--within {self.within:g} --step {self.step:g} is not possible: --within is above "
                "0 and at most --step"
            )
        count = ceil((self.fastest - self.slowest) / self.step - 1e-9) + 1
        if count > MOST:
            raise InputError(
                f"--step {self.step:g} makes {count} speeds; at most {MOST} are allowed"
            )
        evenly = [round(self.slowest + number * self.step, 4) for number in range(count - 1)]
        return [*evenly, self.fastest]


class Stretch(NamedTuple):
    """Neighbouring speeds at which a criterion holds [km/h].

    Attributes
    ----------
    slowest, fastest : the first and last one that was marched
    fails_at : the next faster one, at which it does not hold; None at the end of the range
    """

    slowest: float
    fastest: float
    fails_at: float | None


class Holds(NamedTuple):
    """Where a criterion holds.

    Attributes
    ----------
    criterion : its name, or ``ALL``
    stretches : ascending, empty where it holds at no speed
    fails_by : value and limit at the first failure going up, None where there is none
    unit : of these
    stopped_by : of ``ALL``, the criteria that fail there, or what refuses the speed
    """

    criterion: str
    stretches: tuple[Stretch, ...]
    fails_by: tuple[float, float] | None
    unit: str
    stopped_by: tuple[str, ...]


class SpeedStudy(NamedTuple):
    """What a search has found.

    Attributes
    ----------
    case : name of the case
    speeds : the range
    holds : ``ALL`` first, then each criterion
    not_judged : criteria without a verdict at any speed
    ended : how each speed ended, ascending
    """

    case: str
    speeds: Speeds
    holds: tuple[Holds, ...]
    not_judged: tuple[str, ...]
    ended: tuple[Ended, ...]


def find_speeds(marching: Marching, case: str, speeds: Speeds, wanted: Sequence[str]) -> SpeedStudy:
    """March the speeds, and find where the criteria hold. Collective.

    Parameters
    ----------
    marching : of the case
    case : its name
    wanted : parts of names of criteria, all criteria if there are none

    Raises
    ------
    InputError
        If the range is none, if no speed can be run, or if no criterion has a wanted name.
    Interrupted
        If a signal came.
    """

    def marched(own: Sequence[float]) -> dict[float, Ended]:
        variants = product([VariedKey(KEY, tuple(f"{speed:.8g}" for speed in own))], {})
        return dict(zip(own, marching.of(variants), strict=True))

    ended = marched(speeds.first())
    names, not_judged = _criteria(ended, wanted)
    while more := _between(ended, [ALL, *names], names, speeds.within):
        ended |= marched(more)
    found = tuple(_holds(ended, name, names) for name in (ALL, *names))
    in_order = tuple(ended[speed] for speed in sorted(ended))
    return SpeedStudy(case, speeds, found, tuple(not_judged), in_order)


def _criteria(ended: dict[float, Ended], wanted: Sequence[str]) -> tuple[list[str], list[str]]:
    """Names of the wanted criteria: those that are judged at any speed, and the others."""
    rows = [row for one in ended.values() for row in one.summary.get("acceptance", [])]
    known = list(dict.fromkeys(row["criterion"] for row in rows))
    for text in wanted:
        if not any(text.lower() in name.lower() for name in known):
            raise InputError(
                f"--criterion {shown(text)} is part of no criterion; there are {'; '.join(known)}"
            )
    if wanted:
        known = [name for name in known if any(text.lower() in name.lower() for text in wanted)]
    judged = {row["criterion"] for row in rows if row["passed"] is not None}
    return [n for n in known if n in judged], [n for n in known if n not in judged]


def _row(one: Ended, name: str) -> dict[str, Any] | None:
    """The line of a criterion in a speed's verdict."""
    rows = one.summary.get("acceptance", [])
    return next((row for row in rows if row["criterion"] == name), None)


def _is_held(one: Ended, name: str, names: Sequence[str]) -> bool:
    """Whether a criterion, or each of ``names``, holds; not where a speed could not be run."""
    rows = [_row(one, own) for own in (names if name == ALL else [name])]
    return bool(rows) and all(row is not None and row["passed"] is True for row in rows)


def _between(
    ended: dict[float, Ended], asked: Sequence[str], names: Sequence[str], within: float
) -> list[float]:
    """Middles of neighbouring speeds farther apart than ``within`` of which one fails."""
    speeds = sorted(ended)
    middles = set()
    for slower, faster in zip(speeds, speeds[1:], strict=False):
        if faster - slower > within and any(
            _is_held(ended[slower], name, names) != _is_held(ended[faster], name, names)
            for name in asked
        ):
            middles.add(round(0.5 * (slower + faster), 4))
    return sorted(middles)


def _holds(ended: dict[float, Ended], name: str, names: Sequence[str]) -> Holds:
    speeds = sorted(ended)
    stretches: list[Stretch] = []
    begin: float | None = None
    for number, speed in enumerate(speeds):
        if not _is_held(ended[speed], name, names):
            begin = None
            continue
        begin = speed if begin is None else begin
        following = speeds[number + 1] if number + 1 < len(speeds) else None
        if following is None or not _is_held(ended[following], name, names):
            stretches.append(Stretch(begin, speed, following))
    fails_at = stretches[0].fails_at if stretches else speeds[0]
    failed = None if fails_at is None else ended[fails_at]
    row = None if failed is None else _row(failed, name)
    by = None if row is None or row["value"] is None else (row["value"], row["limit"])
    stopped: tuple[str, ...] = ()
    if name == ALL and failed is not None:
        stopped = tuple(n for n in names if not _is_held(failed, n, names))
        stopped = stopped if failed.done else (failed.outcome,)
    rows = (_row(one, name) for one in ended.values())
    unit = next((str(row["unit"]) for row in rows if row is not None), "")
    return Holds(name, tuple(stretches), by, unit, stopped)


def table_of_criteria(study: SpeedStudy) -> StudyTable:
    """A row for each criterion: from where it holds to the highest speed, and what ends it."""
    columns = [
        Column("criterion", "criterion"),
        Column("holds_from_km_h", "holds from", ".1f"),
        Column("highest_km_h", "to [km/h]", ".1f"),
        Column("fails_at_km_h", "fails at", ".1f"),
        Column("value", "with", ".4g"),
        Column("limit", "limit", ".4g"),
        Column("unit", "unit"),
        Column("more_stretches_km_h", "holds again"),
        Column("stopped_by"),
    ]
    return StudyTable(columns, [_cells(one, study.speeds.slowest) for one in study.holds])


def _cells(one: Holds, slowest: float) -> Row:
    first = one.stretches[0] if one.stretches else None
    value, limit = one.fails_by or (None, None)
    return {
        "criterion": one.criterion,
        "holds_from_km_h": None if first is None else first.slowest,
        "highest_km_h": None if first is None else first.fastest,
        "fails_at_km_h": slowest if first is None else first.fails_at,
        "value": value,
        "limit": limit,
        "unit": one.unit,
        "more_stretches_km_h": [f"{own.slowest:g}-{own.fastest:g}" for own in one.stretches[1:]],
        "stopped_by": list(one.stopped_by),
    }


def as_text(study: SpeedStudy) -> str:
    """The answer in a sentence, and the table of criteria."""
    speeds, whole = study.speeds, study.holds[0]
    counted = f"{len(study.holds) - 1} criteria judged here"
    where = f"from {speeds.slowest:g} to {speeds.fastest:g} km/h"
    if not study.holds[1:]:
        answer = f"No criterion is judged {where}."
    elif not whole.stretches:
        answer = f"At no speed {where} all {counted} hold."
    else:
        first = whole.stretches[0]
        answer = f"All {counted} hold from {first.slowest:.1f} to {first.fastest:.1f} km/h"
        if first.fails_at is None:
            answer += ", the end of the range."
        else:
            answer += f"; at {first.fails_at:.1f} km/h fails: {'; '.join(whole.stopped_by)}."
    lines = [f"{study.case}, {len(study.ended)} speeds {where}. {answer}", ""]
    lines += [table_of_criteria(study).text(), ""]
    if study.not_judged:
        lines.append(f"Not judged: {'; '.join(study.not_judged)}.")
    refused = [one for one in study.ended if not one.done]
    if refused:
        slowest, fastest = refused[0].variant.varied[KEY], refused[-1].variant.varied[KEY]
        lines.append(
            f"{len(refused)} speeds from {slowest} to {fastest} km/h could not be run and count as "
            f"failed; the first: {refused[0].outcome}"
        )
    lines.append(
        "Trains run in the direction of the scene alone. Stretches narrower than "
        f"{speeds.step:g} km/h may be missed."
    )
    return "\n".join([*lines, *remarks_of(study.ended)])


def write(folder: Path, study: SpeedStudy) -> list[Path]:
    """Write tables, record and picture; returns the files. Not collective."""
    criteria, runs = table_of_criteria(study), table_of(study.ended)
    record = {
        "case": study.case,
        **{f"{name}_km_h": value for name, value in study.speeds._asdict().items()},
        "criteria": criteria.records(),
        "not_judged": study.not_judged,
        "runs": runs.records(),
    }
    drawn = partial(draw, study)
    return write_files(folder, {TABLE: criteria, RUNS: runs, RECORD: record, PICTURE: drawn})


@figures.own_style()
def draw(study: SpeedStudy) -> Figure | None:
    """Deviation, extremes and uplift over speed with their limits; speeds at which all criteria
    hold are shaded. None if fewer than two speeds could be run."""
    rows = [row for row in table_of(study.ended).rows if row["outcome"] == "done"]
    if len({row[KEY] for row in rows}) < 2:
        return None
    figure = figures.new_figure(0.6 + 2.0 * len(_PANELS))
    panels = figure.subplots(len(_PANELS), 1, sharex=True)
    names = list(dict.fromkeys(row["pantograph"] for row in rows))
    for (statistic, criterion), axes in zip(_PANELS, panels, strict=True):
        for stretch in study.holds[0].stretches:
            axes.axvspan(stretch.slowest, stretch.fastest, color=figures.SHADE, zorder=0)
        of_line = statistic == "max_uplift_mm"
        for number, name in enumerate(names[:1] if of_line else names):
            own = [row for row in rows if row["pantograph"] == name]
            y = [np.nan if row[statistic] is None else row[statistic] for row in own]
            label = None if of_line else name
            figures.curve(axes, [row[KEY] for row in own], y, number, label, "o-")
        # Limits of all criteria whose names begin so, as one look of dashed lines.
        for places in _limits(study, criterion):
            axes.plot(*zip(*places, strict=True), "--", color=figures.LIMIT, linewidth=1.0)
        figures.tidy(axes, "", STATISTICS[statistic].meaning)
    if any(_limits(study, criterion) for _, criterion in _PANELS):
        panels[0].plot([], [], "--", color=figures.LIMIT, linewidth=1.0, label="limit")
    figures.legend_above(panels[0], columns=min(len(names) + 1, 4))
    panels[-1].set_xlabel("train speed [km/h]")
    return figure


def _limits(study: SpeedStudy, criterion: str) -> list[list[tuple[float, float]]]:
    """Speed and limit [km/h], the criterion's unit, of each criterion whose name begins so."""
    limits: dict[str, list[tuple[float, float]]] = {}
    for one in study.ended:
        for row in one.summary.get("acceptance", []):
            if row["criterion"].startswith(criterion) and row["limit"] is not None:
                place = (float(one.variant.varied[KEY]), float(row["limit"]))
                limits.setdefault(row["criterion"], []).append(place)
    return list(limits.values())
