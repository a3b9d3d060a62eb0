"""Output of a study of tolerances: the table of an installer, that of all criteria, pictures.

Pictures show the share of lines that keep each criterion, and the values of these.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from catenary.cases.studies.tolerance.errors import Samples, least_share
from catenary.cases.studies.tolerance.study import ALL, EACH, Plan, Tolerance, at_least
from catenary.postproc.report.pictures import figures
from catenary.postproc.report.study_table import Column, Content, StudyTable

# Criteria that leave a panel, and a row of panels, legible.
_MOST_CURVES, _MOST_PANELS = 5, 4
# Ticks and characters of labels along a row of panels.
_MOST_TICKS, _WIDTH_OF_LABELS = 16, 100
# Shares are drawn down to so many times the share of lines that may fail.
_DEPTH = 10.0
# Parts of the greatest level: between dots of two criteria, and over which samples are spread.
_BESIDE, _SPREAD = 0.008, 0.018
# Marks of a curve of shares with their sizes, and what the legend says of them.
_RING, _TRIANGLE = ("o", 9.0), ("v", 5.0)
_MARKS = {_RING: "tolerance", _TRIANGLE: "at most, the rest unknown"}
TABLE, RECORD, PAGE = "tolerance.csv", "tolerance.json", "tolerance.md"
SHARES, VALUES = "tolerance_shares.png", "tolerance_values.png"


def files_of(plan: Plan, found: Sequence[Tolerance]) -> dict[str, Content]:
    """All tables and pictures of a study. Not collective."""
    record = {
        "case": plan.name,
        "task": plan.task.model_dump(exclude_none=True),
        "tolerances": [
            _fields(one) | {"levels": one.samples.records() if one.samples else []} for one in found
        ],
    }
    return {
        TABLE: table_of(found),
        RECORD: record,
        PAGE: _markdown(plan, found),
        SHARES: partial(draw_shares, plan, found),
        VALUES: partial(draw_values, found),
    }


def _fields(one: Tolerance) -> dict[str, Any]:
    found = {name: value for name, value in vars(one).items() if name not in ("samples", "bound")}
    return found | {"at_most": one.at_most}


def table_of(found: Sequence[Tolerance]) -> StudyTable:
    """A row for each error and criterion."""
    rows = [
        _fields(one)
        | {
            "shown": one.text,
            "samples": f"{one.kept} of {one.n_samples}" if one.level else "",
            "least_share": one.least_share if one.level else None,
            "linear": one.linear if np.isfinite(one.linear or 0.0) else None,
            "as_run": None if one.checked is None else at_least(one.checked, one.most),
        }
        for one in found
    ]
    # Heads of people's tables; without a worst case these columns stand in files alone.
    has_worst = any(one.linear is not None for one in found)
    slopes, as_run = ("worst case by slopes +-", "as run +-") if has_worst else ("", "")
    columns = (
        Column("error", "error"),
        Column("criterion", "criterion"),
        Column("level"),
        Column("shown", "tolerance +-", ">", in_files=False),
        Column("unit", "unit"),
        Column("at_most"),
        Column("kept"),
        Column("n_samples"),
        Column("samples", "samples keep it", ">", in_files=False),
        Column("least_share", "share at least", ".3f"),
        Column("linear", slopes, ".3g"),
        Column("checked"),
        Column("as_run", as_run, ">", in_files=False),
        Column("lost_at", "a line loses it at +-", ".3g"),
    )
    return StudyTable(columns, rows, "Tolerances by criterion")


def installer_table(plan: Plan, found: Sequence[Tolerance]) -> StudyTable:
    """Tolerance of each error for all criteria at once that the line keeps without errors."""
    rows = []
    together = _of_each([one for one in found if one.error == ALL])
    for group in plan.groups:
        own = [one for one in found if one.error == group.table.name]
        each = _of_each(own)
        row = {"error": group.table.name, "unit": group.unit, "n": len(group.names)}
        row |= {"alone": "none", "lost_at": None, "by": "", "together": ""}
        row["worst"] = None
        if each is not None:
            row |= {"alone": each.text, "lost_at": each.lost_at, "by": _first_to_fail(own)}
            row["worst"] = each.linear if np.isfinite(each.linear or 0.0) else None
        if together is not None:
            level = group.table.level
            row["together"] = at_least(together.level * level, together.most * level)
        rows.append(row)
    columns = [
        Column("error", "error"),
        Column("n", "number", "d"),
        Column("alone", "alone +-", ">"),
        Column("worst", "worst case by slopes +-", ".3g"),
        Column("lost_at", "a line fails at +-", ".3g"),
        Column("together", "all together +-", ">"),
        Column("unit", "unit"),
        Column("by", "first criterion to fail alone"),
    ]
    absent = {"worst"} if not plan.task.samples.worst_case else set()
    absent |= {"together"} if together is None else set()
    columns = [column for column in columns if column.name not in absent]
    title, lost = "Installation tolerances", _lost(found)
    if lost:
        n = len({one.criterion for one in found if one.criterion != EACH})
        title += f" for {n - len(lost)} of {n} criteria: others fail without errors"
    return StudyTable(columns, rows, title)


def _lost(found: Sequence[Tolerance]) -> list[str]:
    """The criteria that the line does not keep without errors."""
    return list(dict.fromkeys(one.criterion for one in found if not one.is_kept))


def _of_each(found: Sequence[Tolerance]) -> Tolerance | None:
    """The tolerance for all criteria at once that the line keeps without errors, None for none."""
    kept = [one for one in found if one.is_kept]
    return next((one for one in kept if one.criterion == EACH), kept[0] if kept else None)


def _first_to_fail(found: Sequence[Tolerance]) -> str:
    """The criterion with the least tolerance of those that the line keeps without errors."""
    kept = [one for one in found if one.criterion != EACH and one.is_kept]
    first = min(kept, key=lambda one: (one.level, one.at_most))
    return "none up to there" if first.at_most else first.criterion


def _remarks(plan: Plan, found: Sequence[Tolerance]) -> list[str]:
    """Sentences on what the tables cannot say."""
    sentences = []
    if lost := _lost(found):
        sentences.append(
            f"not kept without errors, and left out of all tolerances: {', '.join(lost)}"
        )
    if all(not one.is_kept for one in found):
        return sentences
    samples = plan.task.samples
    fail = f"at most {samples.allowed} of them fail" if samples.allowed else "none of them fails"
    sentences.append(
        f"at least {100 * samples.probability:g} % of all lines keep the criteria within their "
        f"tolerance, with {100 * samples.confidence:g} % confidence: {samples.n} samples show this "
        f"if {fail}; tolerances are found to {100 * samples.resolution:g} % of the greatest that "
        "was tried"
    )
    if samples.worst_case:
        sentences.append(
            "`by slopes` is linear in the errors, `as run` is a run of the line with these errors: "
            "where both differ much, the linear estimate fails, and other lines may be worse"
        )
    if any(one.lost_at is not None for one in found):
        sentences.append(
            "`a line fails at` is the smallest tolerance at which a run fails, of a sample or of "
            "the worst case by slopes. If it is not above the tolerance, that line is one of the "
            "few that may fail: a tolerance that all lines keep is smaller"
        )
    return sentences


def as_text(plan: Plan, found: Sequence[Tolerance]) -> str:
    """The results for a terminal."""
    tables = (installer_table(plan, found), table_of(found))
    parts = [f"{table.title}\n{table.text()}\n" for table in tables]
    return "\n".join([*parts, *(f"REMARK      {text}" for text in _remarks(plan, found))])


def _markdown(plan: Plan, found: Sequence[Tolerance]) -> str:
    """The results as a page."""
    tables = (installer_table(plan, found), table_of(found))
    parts = [f"# Tolerances of {plan.name}"]
    parts += [f"## {table.title}\n\n{table.markdown()}" for table in tables]
    parts.append("\n".join(f"- {text}" for text in _remarks(plan, found)))
    return "\n\n".join(parts) + "\n"


@figures.own_style()
def draw_shares(plan: Plan, found: Sequence[Tolerance]) -> Figure | None:
    """Share of lines that keep each criterion over the level, a panel for each error.

    Bars reach between bounds of Clopper and Pearson, each with the task's confidence, and rings
    stand at the tolerances. A dot is open where other levels tell of lines that were not run. Where
    they leave some unknown there is none, and the greatest possible share is a triangle. None if
    the line keeps no criterion without errors.
    """
    names = _criteria(found, _MOST_CURVES)
    errors = list(dict.fromkeys(one.error for one in found))
    if not names:
        return None
    task = plan.task.samples
    figure, panels = figures.stacked(0.2 + 2.8 * len(errors), len(errors))
    deepest = max(0.0, 100.0 - 100.0 * _DEPTH * (1.0 - task.probability))
    for axes, error in zip(panels, errors, strict=True):
        shown = [one for one in found if one.error == error and one.criterion in (*names, EACH)]
        lows = []
        for number, one in enumerate(shown):
            assert one.samples is not None  # the line keeps the criterion
            beside = _BESIDE * one.most * (number - 0.5 * (len(shown) - 1))
            lows.append(_draw_share(axes, one, one.samples, number, beside, task.confidence))
        axes.axhline(100.0 * task.probability, ls="--", color=figures.LIMIT, lw=1.0, zorder=1)
        bottom = max(deepest, min([*lows, 100.0 * task.probability]))
        axes.set_ylim(bottom - 0.05 * (100.0 - bottom), 100.0 + 0.05 * (100.0 - bottom))
        last = shown[-1]  # of all criteria, if there are several
        title = f"{error}, {last.criterion}: {last.text} {last.unit if last.level else ''}"
        figures.tidy(axes, _axis(last), "lines that keep it [%]", title)
    lines = [line for axes in panels for line in axes.lines]
    drawn = {(one.get_marker(), one.get_markersize()) for one in lines if np.size(one.get_xdata())}
    for (marker, size), label in _MARKS.items():
        if (marker, size) in drawn:
            panels[0].plot([], [], marker, ms=size, mfc="none", color=figures.GREY, label=label)
    wanted = f"{100.0 * task.probability:g} % of all lines"
    panels[0].plot([], [], "--", color=figures.LIMIT, lw=1.0, label=wanted)
    figures.legend_above(panels[0])
    return figure


def _draw_share(
    axes: Axes, one: Tolerance, samples: Samples, number: int, beside: float, confidence: float
) -> float:
    """Draw the share for a criterion ``beside`` its levels; returns the least that is shown [%]."""
    fewest, most = samples.n_kept
    n = samples.margins.shape[1]
    known, whole = fewest == most, samples.n_run == n
    # Of all criteria a curve that leaves those below it to be seen.
    look, number = (
        (":", figures.COLOURS.index("#000000"))
        if one.criterion == EACH
        else (figures.LINES[number % 3], number)  # none of these is dotted
    )
    x, share = samples.levels + beside, 100.0 * most / n
    figures.curve(axes, x[known], share[known], number, one.criterion, look, 1.5)
    for of_level, (marker, size), inside in (
        (known & whole, ("o", 3.5), figures.colour(number)),
        (known & ~whole, ("o", 3.5), "white"),
        (~known, _TRIANGLE, "none"),
        (samples.levels == one.level, _RING, "none"),
    ):
        figures.curve(axes, x[of_level], share[of_level], number, None, marker, ms=size, mfc=inside)
    # Without errors all lines are the same one, of which there is nothing to bound.
    bounded = known & (samples.levels > 0.0)
    kept = fewest[bounded].tolist()
    low = [100.0 * least_share(k, n, confidence) for k in kept]
    high = [100.0 - 100.0 * least_share(n - k, n, confidence) for k in kept]
    figures.uprights(axes, x[bounded], low, high, color=figures.colour(number), lw=1.0, alpha=0.7)
    return float(min([*low, *share]))


@figures.own_style()
def draw_values(found: Sequence[Tolerance]) -> Figure | None:
    """Worst value of each criterion of all samples over the level beside its limit, a row of panels
    for each error.

    Grey samples are of levels that were left early, those first that fail elsewhere. Upright lines
    stand at the tolerances. Runs that broke have no values. None if the line keeps no criterion
    without errors.
    """
    names = _criteria(found, _MOST_PANELS)
    errors = list(dict.fromkeys(one.error for one in found))
    if not names:
        return None
    figure = figures.new_figure(0.6 + 2.2 * len(errors))
    panels = figure.subplots(len(errors), len(names), sharey="col", squeeze=False)
    by_name = {(one.error, one.criterion): one for one in found}
    for row, error in zip(panels, errors, strict=True):
        for axes, name in zip(row, names, strict=True):
            _draw_value(axes, by_name[error, name])
            most = _MOST_TICKS // len(names)
            axes.xaxis.set_major_locator(figures.FewTicks(most, steps=figures.STEPS))
            label = figures.wrapped(axes.get_xlabel(), _WIDTH_OF_LABELS // len(names))
            axes.set_xlabel(label, fontsize="small")
        row[0].set_title(error, loc="left", fontsize="medium")
    of_all = zip(*panels[0, 0].get_legend_handles_labels(), strict=True)
    drawn = {
        line.get_label() for axes in panels.flat for line in axes.lines if np.size(line.get_xdata())
    }
    handles = [handle for handle, label in of_all if label in drawn]
    legend = figure.legend(
        handles=handles, loc="outside upper right", ncols=len(handles), frameon=False,
        fontsize="small",
    )  # fmt: skip
    for handle in legend.get_lines():
        handle.set(markersize=4.0, alpha=1.0)
    return figure


def _draw_value(axes: Axes, one: Tolerance) -> None:
    samples, bound = one.samples, one.bound
    assert samples is not None and bound is not None  # the line keeps the criterion
    n = samples.margins.shape[1]
    beside = _SPREAD * one.most * np.linspace(-0.5, 0.5, n)
    x = samples.levels[:, None] + beside * (samples.levels > 0.0)[:, None]
    values, is_known = bound.values(samples.margins), np.isfinite(samples.margins)
    whole = (samples.n_run == n)[:, None]
    for drawn, colour, label in (
        (is_known & whole, figures.colour(0), "all lines run"),
        (is_known & ~whole, figures.GREY, "level left early"),
    ):
        figures.curve(
            axes, x[drawn], values[drawn], 0, label, "o", ms=2.0, mew=0.0, alpha=0.6, color=colour
        )
    axes.axhline(bound.limit, ls="--", color=figures.LIMIT, lw=1.2, label="limit")
    axes.axvline(one.level, color=figures.colour(2), lw=1.2, zorder=1, label="tolerance")
    figures.tidy(axes, _axis(one), "")
    axes.set_ylabel(figures.wrapped(bound.meaning), fontsize="small")


def _criteria(found: Sequence[Tolerance], most: int) -> list[str]:
    """The criteria that the line keeps without errors; of more than ``most`` those with the least
    tolerances."""
    least: dict[str, float] = {}
    for one in found:
        if one.samples is not None and one.criterion != EACH:
            part = one.level / one.most
            least[one.criterion] = min(part, least.get(one.criterion, part))
    shown = sorted(least, key=lambda name: least[name])[:most]
    return [name for name in least if name in shown]


def _axis(one: Tolerance) -> str:
    return f"errors within ± [{one.unit}]"
