"""Results of any program beside a reference solution: difference, error bar, tolerance, verdict.

Results are CSV files: forces along the track, or a table of statistics.
"""

from __future__ import annotations

import functools
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from scipy.interpolate import BSpline, make_interp_spline

from catenary.base.errors import InputError
from catenary.cases.scene.input.plain_text import plain
from catenary.cases.scene.scene import problem_of
from catenary.cases.studies.measured import column_of, columns_in, evened_out, read_table
from catenary.cases.studies.reference.solutions import (
    HISTORY,
    OF_FORCE,
    PLACE,
    QUANTITIES,
    Solution,
    read_solution,
    rms,
)
from catenary.postproc.evaluate import filters
from catenary.postproc.evaluate.statistics import contact_statistics
from catenary.postproc.evaluate.wording import UNCOMPARED
from catenary.postproc.report.study_table import Column, StudyTable

TIME = "time_s"
# Figures of which no sound result is a hundredth of the reference, or a hundred times as large.
_FAR_FROM_ZERO = (
    "mean_N", "std_N", "max_uplift_mm", "contact_height_range_mm", "elasticity_max_mm_per_N",
    "elasticity_min_mm_per_N",
)  # fmt: skip
_QUANTITY, _VALUE, _OF, _CONFIGURATION = "quantity", "value", "of", "configuration"
# Spacing at which extremes of a curve below 20 Hz are looked for [m].
_FINE = 0.02
# EN 50317 samples forces, before they are filtered, more often in a second or in less than [m].
_RATE, _SPACING = 200.0, 0.4
# The filter of EN 50317 leaves 6 % of what is at so many of its cut-offs, and less beyond. Forces
# that have more than this part of their deviation there have not passed it: filtered ones of the
# reference models have at most 0.006, unfiltered ones 0.2.
_STOPPED, _PASSED_BY = 1.6, 0.1
_FROM_STATISTICS = {
    "mean_N": "mean", "std_N": "std", "std_0_5_N": "std_0_5", "std_5_20_N": "std_5_20",
    "stat_max_N": "stat_max", "stat_min_N": "stat_min", "max_N": "maximum", "min_N": "minimum",
    "loss_percent": "loss_percent",
}  # fmt: skip
PASSED, FAILED, NOT_JUDGED = "passed", "failed", "not judged"


@dataclass
class Others:
    """Figures beside a solution.

    Attributes
    ----------
    solution : with which they are compared
    figures : by place of the pantograph, or ``LINE``, and quantity, in its unit
    forces : (n,) below 20 Hz at the places of the solution by place of the pantograph [N]
    remarks : sentences on what limits the comparison
    """

    solution: Solution
    figures: dict[tuple[str, str], float] = field(default_factory=dict)
    forces: dict[str, np.ndarray] = field(default_factory=dict)
    remarks: list[str] = field(default_factory=list)


def read_results(
    files: Sequence[Path], configuration: str | None, is_filtered: bool
) -> list[Others]:
    """Read results of other programs, an entry for each configuration. Not collective.

    A file with a column ``quantity`` is a table of statistics with ``of``, ``value`` and, unless
    ``configuration`` is given, ``configuration``. Others have ``place_m`` or ``time_s``, since the
    start of the run, and a force ``leading_N``, ``trailing_N`` or ``pantograph_N`` each.

    Parameters
    ----------
    configuration : which one files are of
    is_filtered : whether forces have passed the 20 Hz filter of EN 50317

    Raises
    ------
    InputError
        If a file is neither, or does not fit the configuration.
    """
    found: dict[str, Others] = {}
    for path in files:
        table, name = read_table(path), str(path)
        if _QUANTITY in table:
            _add_statistics(found, table, name, configuration)
        elif not {PLACE, TIME} & set(table):
            raise InputError(
                f"{name} has neither a column {PLACE} [m] or {TIME} [s], as forces have, nor "
                f"{_QUANTITY}, as statistics have: it has {columns_in(table)}"
            )
        else:
            if configuration is None:
                raise InputError(
                    f"{name} holds no statistics: name the configuration of its forces, such as "
                    "--of ac_simple_275_one"
                )
            one = found.setdefault(configuration, Others(read_solution(configuration)))
            _add_forces(one, table, name, is_filtered)
    return list(found.values())


def _add_statistics(
    found: dict[str, Others], table: pd.DataFrame, name: str, configuration: str | None
) -> None:
    needed = [_OF, _QUANTITY, _VALUE] + ([] if configuration else [_CONFIGURATION])
    for column in needed:
        if column not in table:
            raise InputError(
                f'{name} has no column "{column}": a table of statistics has {", ".join(needed)}'
            )
        empty = np.flatnonzero(table[column].isna() & (column != _VALUE))
        if empty.size:
            raise InputError(
                f'{name} has nothing in column "{column}", row {empty[0] + 1} below its names'
            )
    if table.empty:
        raise InputError(f"{name} has no rows: it gives no statistics to judge")
    values = column_of(table, name, _VALUE)
    for row, value in zip(table.to_dict("records"), values.tolist(), strict=True):
        of, quantity = str(row[_OF]), str(row[_QUANTITY])
        own = configuration or str(row[_CONFIGURATION])
        if own != str(row.get(_CONFIGURATION, own)):
            raise InputError(
                f"{name} has statistics of {plain(str(row[_CONFIGURATION]), 60)}, and --of names "
                f"{plain(own, 60)}: leave --of away"
            )
        one = found.setdefault(own, Others(read_solution(own)))
        if (of, quantity) not in one.solution.figures:
            known = ", ".join(q for place, q in one.solution.figures if place == of)
            places = ", ".join(dict.fromkeys(place for place, _ in one.solution.figures))
            raise InputError(
                f'{name} has "{plain(quantity, 60)}" of "{plain(of, 60)}": {own} has '
                + (f"of it {known}" if known else f"figures of {places}")
            )
        _check_unit(one.solution, of, quantity, value, name)
        _add(one, of, quantity, value, name)


def _add(one: Others, of: str, quantity: str, value: float, name: str) -> None:
    """Add a figure; raises InputError if the files give it twice."""
    if (of, quantity) in one.figures:
        where = one.solution.configuration.name
        raise InputError(f"{name} gives {quantity} of {of} for {where}, which was given before")
    one.figures[of, quantity] = value


def _check_unit(solution: Solution, of: str, quantity: str, value: float, name: str) -> None:
    """Raise InputError if a figure is a hundred times off, as one in another unit is."""
    reference, _ = solution.figures[of, quantity]
    if quantity in _FAR_FROM_ZERO and not 0.01 < value / reference < 100.0:
        raise InputError(
            f"{name} gives {value:g} for {quantity} of {of}, where {solution.configuration.name} "
            f"has {reference:g}: numbers are in the unit that ends the name of a column or quantity"
        )


def _add_forces(one: Others, table: pd.DataFrame, name: str, is_filtered: bool) -> None:
    solution = one.solution
    there = [of for of in solution.forces if f"{of}_N" in table]
    if not there:
        raise InputError(
            f"{name} has no column {' or '.join(f'{of}_N' for of in solution.forces)}, the forces "
            f"of {solution.configuration.name} [N]: it has {columns_in(table)}"
        )
    for of in there:
        place, dt = _places_of(one, of, table, name)
        force = column_of(table, name, f"{of}_N")
        start, end = solution.stretch
        if place[0] > start + 1e-6 or place[-1] < end - 1e-6:
            raise InputError(
                f"{name} covers {place[0]:.1f} to {place[-1]:.1f} m; {solution.configuration.name} "
                f"is evaluated from {start:g} to {end:g} m"
            )
        if is_filtered:
            _remark_on_filter(one, of, force, dt)
            curve = curve_through(place, force)
            fine = curve(np.linspace(start, end, 1 + round((end - start) / _FINE)))
            mean, std = float(fine.mean()), float(fine.std())
            own = {
                "mean_N": mean, "std_N": std, "max_N": float(fine.max()),
                "min_N": float(fine.min()), "stat_max_N": mean + 3 * std,
                "stat_min_N": mean - 3 * std,
            }  # fmt: skip
        else:
            _remark_on_samples(one, of, place[1] - place[0], dt)
            _remark_on_ends(one, of, place, dt)
            found = contact_statistics(of, place, force, np.zeros_like(force), dt, solution.stretch)
            own = {key: getattr(found, word) for key, word in _FROM_STATISTICS.items()}
            curve = curve_through(place, filters.low_pass(force, dt))
        _check_unit(solution, of, "mean_N", own["mean_N"], name)
        one.forces[of] = curve(solution.place)
        for quantity in (column.name for column in OF_FORCE if column.name in own):
            _add(one, of, quantity, own[quantity], name)
        _add(one, of, HISTORY, rms(one.forces[of] - solution.forces[of]), name)


def curve_through(place: np.ndarray, force: np.ndarray) -> BSpline:
    """A curve through samples below 20 Hz.

    Of degree 7: with four samples a period, as at 1 m and 80 m/s, a cubic is off by some percent of
    what is at 20 Hz, 0.3 N at the least force of a run.
    """
    return make_interp_spline(place, force, 7)


def _places_of(one: Others, of: str, table: pd.DataFrame, name: str) -> tuple[np.ndarray, float]:
    """Places of the samples [m], and the time between two [s]; of places and times places count,
    and a remark tells if they differ."""
    solution = one.solution
    train = problem_of(solution.configuration.scene()).train
    number = list(solution.forces).index(of)
    start = train.start - train.placements[number].behind
    by_time = start + train.speed * column_of(table, name, TIME) if TIME in table else None
    stated = (
        by_time if by_time is not None and PLACE not in table else column_of(table, name, PLACE)
    )
    place = evened_out(stated, name, is_described=False)
    spacing = place[1] - place[0]
    off = 0.0 if by_time is None else float(np.abs(by_time - stated).max())
    if off > spacing:
        one.remarks.append(
            f"{name} has {PLACE} and {TIME}, by which the {of} is up to {off:.4g} m elsewhere: "
            f"{PLACE} counts."
        )
    dt = spacing / train.speed
    if 2.0 * filters.CUT_OFF * dt >= 1.0:
        raise InputError(
            f"{name} has a sample every {spacing:.3g} m, {1 / dt:.3g} a second: a force up to "
            f"{filters.CUT_OFF:g} Hz takes more than {2 * filters.CUT_OFF:g}"
        )
    return place, dt


def _remark_on_filter(one: Others, of: str, force: np.ndarray, dt: float) -> None:
    """Tell if a force that is said to be filtered is not; samples may be too rare to see it."""
    cut_off = _STOPPED * filters.CUT_OFF
    if 2.0 * cut_off * dt >= 1.0:
        return
    beyond = float(np.std(force - filters.low_pass(force, dt, cut_off)))
    if beyond > _PASSED_BY * float(np.std(force)):
        one.remarks.append(
            f"{of}_N has a standard deviation of {beyond:.1f} N above {cut_off:g} Hz, where the "
            f"{filters.CUT_OFF:g} Hz filter leaves next to nothing: a force that has not passed it "
            "takes --unfiltered."
        )


def _remark_on_samples(one: Others, of: str, spacing: float, dt: float) -> None:
    """Tell if samples of an unfiltered force fold what is fast into the band that is judged."""
    if spacing > _SPACING and 1.0 / dt < _RATE:
        one.remarks.append(
            f"{of}_N has a sample every {spacing:.3g} m, {1 / dt:.3g} a second, before the filter: "
            f"what is faster than {1 / dt - filters.CUT_OFF:.3g} Hz looks as if it were below "
            f"{filters.CUT_OFF:g} Hz, and figures may be wrong by several newtons. EN 50317 takes "
            f"more than {_RATE:g} samples a second, or one in less than {_SPACING:g} m."
        )


def _remark_on_ends(one: Others, of: str, place: np.ndarray, dt: float) -> None:
    start, end = one.solution.stretch
    speed = (place[1] - place[0]) / dt
    reach = filters.SETTLED / filters.CUT_OFF * speed
    beyond = min(start - place[0], place[-1] - end)
    if beyond < reach:
        one.remarks.append(
            f"The record of {of}_N goes on only {beyond:.1f} m beyond the stretch: the 20 Hz "
            f"filter needs {reach:.0f} m, and the force near its end is distorted."
        )


COLUMNS = (
    Column("configuration", "configuration"),
    Column("of", "of"),
    Column("quantity"),
    Column("meaning", "quantity", in_files=False),
    Column("value", "value", ".3f"),
    Column("reference", "reference", ".3f"),
    Column("difference", "difference", "+.3f"),
    Column("error_bar", "error bar", ".4f"),
    Column("within_bar", "within bar"),
    Column("lower", "from", ".3f"),
    Column("upper", "to", ".3f"),
    Column("verdict", "verdict"),
    Column("mark", " ", in_files=False),
    Column("clause"),
    Column("compared"),
)


@functools.cache
def limits() -> dict[str, Any]:
    """Limits of EN 50318 as ``limits.toml`` has them. Not collective."""
    return tomllib.loads(Path(__file__).with_name("limits.toml").read_text(encoding="utf-8"))


def judged(
    solution: Solution,
    figures: Mapping[tuple[str, str], float],
    same_rule: Mapping[str, Any] | None = None,
) -> list[dict[str, Any]]:
    """A row of ``COLUMNS`` for each figure that the solution has, too.

    The tolerance is one of EN 50318; where there is none, the figure is not judged. A figure is
    within the bar if it differs by no more than the reference's own error bar.

    Parameters
    ----------
    figures : by place of the pantograph, or ``LINE``, and quantity, in its unit
    same_rule : the tolerance of all figures, in place of those of EN 50318
    """
    rows = []
    for key, value in figures.items():
        if key not in solution.figures:
            continue
        of, quantity = key
        reference, bar = solution.figures[key]
        tolerances = limits()["tolerances"]
        rule = same_rule or next((one for one in tolerances if one["quantity"] == quantity), None)
        bounds = None if rule is None else bounds_of(rule, reference)
        row = judged_row(solution.configuration.name, of, quantity, value, bounds, rule)
        row |= {"reference": reference, "difference": value - reference, "error_bar": bar}
        rows.append(row | {"within_bar": "yes" if abs(value - reference) <= bar else "no"})
    return rows


def bounds_of(rule: Mapping[str, Any], reference: float) -> tuple[float, float]:
    """Least and largest value of a figure by its ``reference``, in its unit; ``rule`` has
    ``absolute`` or ``percent``."""
    allowed = float(rule.get("absolute", 0.01 * rule.get("percent", 0.0) * abs(reference)))
    return reference - allowed, reference + allowed


def judged_row(
    where: str,
    of: str,
    quantity: str,
    value: float,
    bounds: tuple[float, float] | None,
    rule: Mapping[str, Any] | None,
) -> dict[str, Any]:
    """A row of ``COLUMNS`` without a reference.

    Parameters
    ----------
    where : configuration or case
    of : place of the pantograph, or ``LINE``
    quantity : its name, or words
    value : in the quantity's unit
    bounds : least and largest value, None if there are none
    rule : has ``clause`` and ``compared``; None if there are no bounds
    """
    row: dict[str, Any] = dict.fromkeys(column.name for column in COLUMNS)
    row |= {"configuration": where, "of": of, "quantity": quantity, "value": value}
    row["verdict"] = NOT_JUDGED
    if bounds is not None and rule is not None:
        lower, upper = row["lower"], row["upper"] = bounds
        row["verdict"] = PASSED if lower <= value <= upper else FAILED
        row["clause"], row["compared"] = rule["clause"], rule["compared"]
    return row | _words(row)


def _words(row: Mapping[str, Any]) -> dict[str, str]:
    """Further cells of a row for readers: meaning of its quantity, mark if it is not compared."""
    known = QUANTITIES.get(row["quantity"])
    mark = UNCOMPARED if row["compared"] is False else ""
    return {"meaning": known.meaning if known else row["quantity"], "mark": mark}


def table_of(rows: Sequence[dict[str, Any]], title: str) -> StudyTable:
    """The rows as a table."""
    return StudyTable(COLUMNS, rows, title)


def readers_table(rows: Sequence[Mapping[str, Any]], title: str) -> StudyTable:
    """The rows for readers, also those of a file, without columns that are empty throughout.

    Whether a figure is within the reference's bar is counted elsewhere, and seen from both.
    """
    rows = [{**row, **_words(row), "within_bar": None} for row in rows]
    filled = [one for one in COLUMNS if any(row[one.name] not in (None, "") for row in rows)]
    return StudyTable(filled, rows, title)


def any_failed(rows: Sequence[Mapping[str, Any]]) -> bool:
    """Whether a figure is beyond its tolerance."""
    return any(row["verdict"] == FAILED for row in rows)


def counts(rows: Sequence[Mapping[str, Any]]) -> str:
    """Numbers of figures within tolerances, within error bars, and not judged, in words."""
    kept = sum(row["verdict"] == PASSED for row in rows)
    open_ = sum(row["verdict"] == NOT_JUDGED for row in rows)
    barred = [row for row in rows if row["error_bar"] is not None]
    within = sum(row["within_bar"] == "yes" for row in barred)
    words = f"{kept} of {len(rows) - open_} judged figures are within their limits"
    if open_:
        words += f"; {open_} have no limit"
    if barred:
        words += f"; {within} of {len(barred)} are within the reference's error bar"
    return words + "."
