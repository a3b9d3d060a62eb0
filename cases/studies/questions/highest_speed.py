"""Highest speed at which acceptance criteria hold: an ensemble over speeds, then bisection.

A criterion holds at a speed if it does so for the train in both directions. Criteria are not
monotonic in speed: mean-force limits are also missed at low speeds, and resonances of the line make
stretches of speeds between which a criterion fails. The search therefore keeps all stretches that
the first, even division shows, and bisects each of their ends.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, replace
from functools import partial
from itertools import groupby, product
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure

from catenary.base.errors import InputError
from catenary.base.options import option
from catenary.cases.scene.input.faults import shown
from catenary.cases.scene.scene import Scene
from catenary.cases.scene.turned import BACKWARD, DIRECTIONS, FORWARD, has_mirrored_line, turned
from catenary.cases.studies.asked import Speeds
from catenary.cases.studies.sweep.jobs import STATISTICS, Ended
from catenary.cases.studies.sweep.output import DIRECTION, remarks_of, table_of
from catenary.cases.studies.sweep.together import Marching
from catenary.cases.studies.sweep.variants import VariedKey
from catenary.cases.studies.sweep.variants import product as variants_of
from catenary.postproc.evaluate.wording import capital, counted, decimals_that_tell, fixed
from catenary.postproc.report.pictures import figures
from catenary.postproc.report.study_table import Column, Content, Row, StudyTable

KEY = "train.speed_km_h"
ALL, BOTH = "all criteria", "both"
TABLE, RUNS, RECORD, PICTURE = "speed.csv", "speeds.csv", "speed.json", "speed.png"
# Statistic of a panel, and the criteria whose limits stand in it.
_PANELS = (
    ("std_N", "standard deviation"),
    ("max_N", "maximum contact force"),
    ("min_N", "minimum contact force"),
    ("max_uplift_mm", "contact-wire uplift"),
)
_LIMITS = ("--", "-.")


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
    """Speeds at which a criterion holds.

    Attributes
    ----------
    criterion : its name, or ``ALL``
    stretches : in all directions, ascending, empty where it holds at no speed
    highest : last speed of the first stretch of each direction by itself [km/h], None without one
    fails_by : value and limit at the first failure going up, None where there is none; of two
        directions that fail those of the one that is further off
    unit : of these
    direction : that fails there, or ``BOTH``
    stopped_by : of ``ALL``, the criteria that fail there, or what refuses the speed
    """

    criterion: str
    stretches: tuple[Stretch, ...]
    highest: Mapping[str, float | None]
    fails_by: tuple[float, float] | None
    unit: str
    direction: str
    stopped_by: tuple[str, ...]


class SpeedStudy(NamedTuple):
    """Result of a search.

    Attributes
    ----------
    case : name of the case
    speeds : the range
    directions : in which trains were marched
    one_way : why that is one direction, empty if both were
    holds : ``ALL`` first, then each criterion
    not_judged : criteria without a verdict at any speed
    ended : how each speed ended, ascending, direction by direction
    """

    case: str
    speeds: Speeds
    directions: tuple[str, ...]
    one_way: str
    holds: tuple[Holds, ...]
    not_judged: tuple[str, ...]
    ended: tuple[Ended, ...]


def find_speeds(
    marching: Marching, speeds: Speeds, wanted: Sequence[str], direction: str | None = None
) -> SpeedStudy:
    """March the speeds, and find where the criteria hold. Collective.

    Parameters
    ----------
    marching : of the case
    speeds : instead of the case's own
    wanted : parts of names of criteria, all criteria if there are none
    direction : "forward" or "backward"; both if None, as far as the scene can be turned

    Raises
    ------
    InputError
        If the range is invalid, if no speed can be run, if no criterion has a wanted name, or if
        the scene cannot be turned for the one ``direction``.
    Interrupted
        If a signal came.
    """
    case = marching.scene.case.name
    marched, alike, one_way = _directions(marching.scene, direction)
    judged = DIRECTIONS if alike else marched
    ended: _Marched = {}

    def march(own: Sequence[float]) -> None:
        vary = [VariedKey(KEY, tuple(f"{speed:.8g}" for speed in own))]
        variants = [
            replace(one, name=f"{one.name}__{way}", direction=way)
            for way in marched
            for one in variants_of(vary, {}, "among the speeds")
        ]
        places = product(judged, own)
        found = marching.of(variants)
        ended.update(zip(places, [*found, *found] if alike else found, strict=True))

    march(speeds.first())
    names, not_judged = _criteria(ended.values(), wanted)
    while more := _between(ended, judged, names, speeds.within):
        march(more)
    found = tuple(_holds(ended, name, names, judged) for name in (ALL, *names))
    in_order = tuple(ended[place] for place in product(marched, _speeds(ended)))
    return SpeedStudy(case, speeds, marched, one_way, found, tuple(not_judged), in_order)


def _directions(scene: Scene, wanted: str | None) -> tuple[tuple[str, ...], bool, str]:
    """Directions to march in, whether the other one is alike, and why these are not both."""
    if wanted not in (None, *DIRECTIONS):
        raise InputError(f"the direction {shown(wanted)} is none of {', '.join(DIRECTIONS)}")
    chosen = f"Trains run {wanted} alone, as chosen."
    if wanted == FORWARD:
        return (FORWARD,), False, chosen
    try:
        there = turned(scene)
    except InputError as error:
        if wanted is not None:
            raise
        return (FORWARD,), False, f"Trains run forward alone: {error}."
    if wanted is not None:
        return (BACKWARD,), False, chosen
    if has_mirrored_line(scene, there):
        mirrored = "The line is its own mirror image, so that backward is as forward."
        return (FORWARD,), True, mirrored
    return DIRECTIONS, False, ""


# Outcomes by direction and speed.
_Marched = dict[tuple[str, float], Ended]


def _speeds(ended: _Marched) -> list[float]:
    return sorted({speed for _, speed in ended})


def _criteria(ended: Iterable[Ended], wanted: Sequence[str]) -> tuple[list[str], list[str]]:
    """Names of the wanted criteria: judged at some speed, and judged at none."""
    rows = [row for one in ended for row in one.summary.get("acceptance", [])]
    known = list(dict.fromkeys(row["criterion"] for row in rows))
    for text in wanted:
        if not any(text.lower() in name.lower() for name in known):
            raise InputError(
                f"{option('--criterion', 'criteria')} {shown(text)} is part of no criterion; there "
                f"are {'; '.join(known)}"
            )
    if wanted:
        known = [name for name in known if any(text.lower() in name.lower() for text in wanted)]
    judged = {row["criterion"] for row in rows if row["passed"] is not None}
    return [n for n in known if n in judged], [n for n in known if n not in judged]


def _row(one: Ended, name: str) -> dict[str, Any] | None:
    """The line of a criterion in a speed's verdict."""
    rows = one.summary.get("acceptance", [])
    return next((row for row in rows if row["criterion"] == name), None)


def _is_held(
    ended: _Marched, speed: float, directions: Sequence[str], names: Sequence[str]
) -> bool:
    """Whether each of the criteria holds in each direction; not where a speed could not be run."""
    rows = [_row(ended[way, speed], name) for way in directions for name in names]
    return bool(rows) and all(row is not None and row["passed"] is True for row in rows)


def _between(
    ended: _Marched, directions: Sequence[str], names: Sequence[str], within: float
) -> list[float]:
    """Midpoints between neighbouring speeds, one passing and one failing, farther apart than
    ``within``."""
    speeds, middles = _speeds(ended), []
    for slower, faster in zip(speeds, speeds[1:], strict=False):
        if faster - slower > within and any(
            _is_held(ended, slower, [way], [name]) != _is_held(ended, faster, [way], [name])
            for way in directions
            for name in names
        ):
            middles.append(round(0.5 * (slower + faster), 4))
    return middles


def _stretches(
    ended: _Marched, directions: Sequence[str], names: Sequence[str]
) -> tuple[Stretch, ...]:
    """Speeds at which each criterion holds in each direction, ascending."""
    speeds = _speeds(ended)
    following = dict(zip(speeds, [*speeds[1:], None], strict=True))
    neighbours = groupby(speeds, key=lambda speed: _is_held(ended, speed, directions, names))
    held = [list(own) for holds, own in neighbours if holds]
    return tuple(Stretch(own[0], own[-1], following[own[-1]]) for own in held)


def _holds(ended: _Marched, name: str, names: Sequence[str], directions: Sequence[str]) -> Holds:
    own = names if name == ALL else [name]
    stretches = _stretches(ended, directions, own)
    highest = {}
    for way in directions:
        alone = _stretches(ended, [way], own)
        highest[way] = alone[0].fastest if alone else None
    fails_at = stretches[0].fails_at if stretches else _speeds(ended)[0]
    failed = {
        way: ended[way, fails_at]
        for way in directions
        if fails_at is not None and not _is_held(ended, fails_at, [way], own)
    }
    rows = [_row(one, name) for one in failed.values()]
    by = [(row["value"], row["limit"]) for row in rows if row and row["value"] is not None]
    stopped: list[str] = []
    for one in failed.values() if name == ALL else ():
        missed = [n for n in names if (row := _row(one, n)) is None or row["passed"] is not True]
        stopped += missed if one.done else [one.outcome]
    units = (str(row["unit"]) for one in ended.values() if (row := _row(one, name)))
    fails_by = max(by, key=lambda pair: abs(pair[0] - pair[1]), default=None)
    direction = next(iter(failed), "") if len(failed) < 2 else BOTH
    stopped_by = tuple(dict.fromkeys(stopped))
    return Holds(name, stretches, highest, fails_by, next(units, ""), direction, stopped_by)


def table_of_criteria(study: SpeedStudy) -> StudyTable:
    """A row for each criterion: from where it holds to the highest speed, and what ends it."""
    form = study.speeds.form
    columns = [
        Column("criterion", "criterion"),
        Column("holds_from_km_h", "holds from", form),
        Column("highest_km_h", "to [km/h]", form),
        Column("fails_at_km_h", "fails at", form),
        Column("direction", "direction"),
        Column("value"),
        Column("limit"),
        Column("shown_value", "with", in_files=False),
        Column("shown_limit", "limit", in_files=False),
        Column("unit", "unit"),
        Column("more_stretches_km_h", "holds again"),
        *(Column(f"highest_{way}_km_h") for way in DIRECTIONS),
        Column("stopped_by"),
    ]
    return StudyTable(columns, [_cells(one, study.speeds.slowest) for one in study.holds])


def _cells(one: Holds, slowest: float) -> Row:
    holds_from, highest, fails_at = one.stretches[0] if one.stretches else (None, None, slowest)
    value, limit = one.fails_by or (None, None)
    digits = decimals_that_tell(value, limit, 2)
    shown = [None if own is None else fixed(own, digits) for own in (value, limit)]
    return {
        "criterion": one.criterion,
        "holds_from_km_h": holds_from,
        "highest_km_h": highest,
        "fails_at_km_h": fails_at,
        "value": value,
        "limit": limit,
        "shown_value": shown[0],
        "shown_limit": shown[1],
        "direction": one.direction,
        **{f"highest_{way}_km_h": one.highest.get(way) for way in DIRECTIONS},
        "unit": one.unit,
        "more_stretches_km_h": [f"{own.slowest:g}-{own.fastest:g}" for own in one.stretches[1:]],
        "stopped_by": list(one.stopped_by),
    }


def as_text(study: SpeedStudy) -> str:
    """The answer in a sentence, and the table of criteria."""
    speeds, whole, *judged = study.speeds, *study.holds
    all_of_them = f"all {len(judged)} criteria judged here hold"
    hold = "the one criterion judged here holds" if len(judged) == 1 else all_of_them
    where = f"from {speeds.slowest:g} to {speeds.fastest:g} km/h"
    if not judged:
        answer = f"No criterion is judged {where}."
    elif not whole.stretches:
        answer = f"At no speed {where} {hold}."
    else:
        first = whole.stretches[0]
        slowest, fastest = (format(speed, speeds.form) for speed in first[:2])
        answer = f"{capital(hold)} from {slowest} to {fastest} km/h"
        if first.fails_at is None:
            answer += ", the end of the range."
        else:
            both = whole.direction == BOTH
            way = "in both directions" if both else f"in the {whole.direction} direction"
            by = "; ".join(whole.stopped_by)
            fails_at = format(first.fails_at, speeds.form)
            answer += f"; at {fails_at} km/h stopped {way} by: {by}."
    n_speeds = len(study.ended) // len(study.directions)
    lines = [f"{study.case}, {n_speeds} speeds {where}. {answer}", ""]
    lines += [table_of_criteria(study).text(), ""]
    if study.not_judged:
        lines.append(f"Not judged: {'; '.join(study.not_judged)}.")
    refused = [one for one in study.ended if not one.done]
    if refused:
        beyond = [float(one.variant.varied[KEY]) for one in refused]
        lines.append(
            f"{counted(len(refused), 'run')} from {min(beyond):g} to {max(beyond):g} km/h could "
            f"not be made and counted as failed; the first: {refused[0].outcome}"
        )
    directions = study.one_way or "Each speed was run in both directions, and counts if both hold."
    lines.append(f"{directions} Stretches narrower than {speeds.step:g} km/h may be missed.")
    return "\n".join([*lines, *remarks_of(study.ended)])


def files_of(study: SpeedStudy) -> dict[str, Content]:
    """Tables, record and picture. Not collective."""
    criteria, runs = table_of_criteria(study), table_of(study.ended)
    record = {
        "case": study.case,
        **{f"{name}_km_h": value for name, value in asdict(study.speeds).items()},
        "directions": study.directions,
        "one_way": study.one_way,
        "criteria": criteria.records(),
        "not_judged": study.not_judged,
        "runs": runs.records(),
    }
    drawn = partial(draw, study)
    return {TABLE: criteria, RUNS: runs, RECORD: record, PICTURE: drawn}


@figures.own_style()
def draw(study: SpeedStudy) -> Figure | None:
    """Deviation, extremes and uplift over speed with their limits; speeds at which all criteria
    hold are shaded. None if fewer than two speeds could be run."""
    rows = [row for row in table_of(study.ended).rows if row["outcome"] == "done"]
    if len({row[KEY] for row in rows}) < 2:
        return None
    figure, panels = figures.panels(0.6 + 2.0 * len(_PANELS), len(_PANELS), 1, sharex=True)
    names = list(dict.fromkeys(row["pantograph"] for row in rows))
    looks = dict(zip(study.directions, ("-", ":"), strict=False))
    for (statistic, criterion), axes in zip(_PANELS, panels, strict=True):
        for stretch in study.holds[0].stretches:
            axes.axvspan(stretch.slowest, stretch.fastest, color=figures.SHADE, zorder=0)
        of_line = statistic == "max_uplift_mm"
        for (number, name), (way, look) in product(
            enumerate(names[:1] if of_line else names), looks.items()
        ):
            own = [row for row in rows if (row["pantograph"], row[DIRECTION]) == (name, way)]
            y = [np.nan if row[statistic] is None else row[statistic] for row in own]
            label = f"{name}, {way}" if len(looks) > 1 else name
            label = label if axes is panels[0] else None
            speeds = [row[KEY] for row in own]
            # The line has a look of its own among several pantographs.
            shown = 2 if of_line and len(names) > 1 else number
            figures.curve(axes, speeds, y, shown, label, figures.mark(shown) + look)
        limits = _limits(study, criterion, names)
        # Those of all pantographs and both directions have one look and name.
        rests = list(dict.fromkeys(rest for rest, _ in limits))
        for number, (rest, places) in enumerate(limits):
            label = f"limit{rest}" if len(rests) > 1 else "limit"
            is_first = rest not in [other for other, _ in limits[:number]]
            how: Any = {"linewidth": 1.0, "label": label if is_first else None}
            look = _LIMITS[rests.index(rest) % len(_LIMITS)]
            axes.plot(*zip(*places, strict=True), look, color=figures.LIMIT, **how)
        figures.tidy(axes, "", STATISTICS[statistic].meaning.replace(", ", ",\n"))
    panels[0].fill_between([], [], color=figures.SHADE, label="all criteria hold")
    for axes in panels:
        if axes.get_legend_handles_labels()[0]:
            figures.legend_above(axes, columns=4)
    panels[-1].set_xlabel("train speed [km/h]")
    return figure


def _limits(
    study: SpeedStudy, criterion: str, pantographs: Sequence[str]
) -> list[tuple[str, list[tuple[float, float]]]]:
    """Of each criterion whose name begins so the rest of its name without the pantograph, and speed
    and limit [km/h], the criterion's unit."""
    limits: dict[tuple[str, str], list[tuple[float, float]]] = {}
    for one in study.ended:
        way = one.variant.direction
        for row in one.summary.get("acceptance", []):
            if row["criterion"].startswith(criterion) and row["limit"] is not None:
                place = (float(one.variant.varied[KEY]), float(row["limit"]))
                limits.setdefault((way, row["criterion"]), []).append(place)
    whose = "|".join(map(re.escape, pantographs))
    return [
        (re.sub(f", ({whose})$", "", name.removeprefix(criterion)), places)
        for (_, name), places in limits.items()
    ]
