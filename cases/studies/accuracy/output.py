"""Output of an accuracy study: tables as CSV, JSON, text and page, the work-precision diagram."""

from __future__ import annotations

import math
import re
import shlex
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from catenary.cases.studies.accuracy.analysis import (
    HISTORY,
    QUANTITIES,
    Row,
    advice,
    observed_orders,
    pareto,
)
from catenary.cases.studies.accuracy.axes import AXES, DISCRETISATION, Axis
from catenary.cases.studies.accuracy.runs import Measured, PlannedAxis
from catenary.postproc.evaluate.wording import capital, counted
from catenary.postproc.files.disk import plain
from catenary.postproc.report.pictures import figures
from catenary.postproc.report.study_table import Column, Content, StudyTable, remark_lines

TABLE, RECORD, PAGE = "accuracy.csv", "accuracy.json", "accuracy.md"
PICTURE = "work_precision.png"
_ADVISED = ("std", HISTORY)
_USUAL_REPEATS = 3  # that of the command line
# Width and height that a name takes in the diagram, in its pixels.
_ROOM = np.array([50.0, 12.0])
# Share of the axis beside the outermost points, for their names.
_MARGIN = 0.09


def files_of(found: Measured, target: float) -> dict[str, Content]:
    """Table, record, page and diagram. Not collective.

    Advice is for errors of at most ``target`` [%]. The diagram is left out if no axis of
    discretisation was varied.
    """
    content: dict[str, Content] = {TABLE: table_of(found.rows), RECORD: _record(found, target)}
    drawn = any(row.done for axis in _precise(found) for row in found.rows_of(axis.name))
    if drawn:
        content[PICTURE] = lambda: draw(found)
    content[PAGE] = page(found, advices(found, target), PICTURE if drawn else "")
    return content


def table_of(rows: Sequence[Row], axis: Axis | None = None) -> StudyTable:
    """Table of rows: those of one ``axis``, for people, or without it those of all axes, for
    files."""
    figures_of = [_figures_of(row, axis) for row in rows]
    if axis is None:
        names = [name for name in _figures_of(Row("", "", "done")) if name not in _FOR_PEOPLE]
        return StudyTable([*map(Column, names)], figures_of)
    shown = {f"error_{name}_percent": name for name in QUANTITIES}
    for part in ("step", "mesh") if any(row.by_step for row in rows) else ():
        shown[f"error_{HISTORY}_by_{part}_percent"] = f"{HISTORY} by {part}"
    shown |= {"estimate_over_true": "est/true", "rounds_per_step": "solves", "march_s_per_s": "s/s"}
    columns = [Column("setting", axis.name)]
    columns += [Column(name, head, ".3g") for name, head in shown.items()]
    return StudyTable([*columns, Column("n_remarks", "remarks", "d")], figures_of)


_FOR_PEOPLE = ("setting", "estimate_over_true", "n_remarks")


def _figures_of(row: Row, axis: Axis | None = None) -> dict[str, Any]:
    """A row under names with units; what is unknown is None."""
    h, true = row.sizes.get("h"), row.errors.get(HISTORY)
    table: dict[str, Any] = {"axis": row.axis, "level": row.level, "outcome": row.outcome}
    table["dt_s"] = row.sizes.get("dt")
    table["elements_per_gap"] = None if h is None else round(1.0 / h)
    for name, quantity in QUANTITIES.items():
        table[f"error_{name}_{quantity.unit}"] = row.errors.get(name)
        table[f"error_{name}_percent"] = row.percent.get(name)
    for name in _ADVISED:
        table[f"error_{name}_by_step_percent"] = row.by_step.get(name)
        table[f"error_{name}_by_mesh_percent"] = row.by_mesh.get(name)
    table["estimated_history_N"] = plain(row.estimate)
    table["rounds_per_step"] = plain(row.iterations)
    table["march_s_per_s"] = plain(row.cost)
    table["n_timed"] = row.timings
    table["remarks"] = list(row.remarks)
    of_step = axis is not None and axis.refined == "dt" and true
    ratio = row.estimate / true if of_step and true else math.nan
    for_people = (in_words(row.level), plain(ratio), len(row.remarks) or None)
    return table | dict(zip(_FOR_PEOPLE, for_people, strict=True))


def as_text(found: Measured, target: float) -> str:
    """All tables for a terminal, observed orders, and advice for errors of at most ``target``
    [%]."""
    parts = []
    for planned in found.plan.axes:
        axis, rows = planned.axis, found.rows_of(planned.axis.name)
        against = "difference of models from the case as it is"
        if axis.kind == DISCRETISATION:
            against = f"error against {run_in_words(planned.reference)}"
        parts += [f"{axis.title}: {against} [%]", table_of(rows, axis).text()]
        if axis.kind == DISCRETISATION:
            parts.append(uncertainty_text(planned, found.uncertainty[axis.name]))
        parts += [*order_lines(axis, rows), ""]
    return "\n".join([*parts, *advices(found, target), *remark_lines(runs_with_remarks(found))])


def page(found: Measured, sentences: Sequence[str], picture: str) -> str:
    """A page of Markdown with one table an axis, and what the study recommends first.

    Parameters
    ----------
    found : result of the study
    sentences : the recommendations
    picture : file of the work-precision diagram, empty for none
    """
    parts = [
        f"# Accuracy and cost: {found.plan.case}",
        f"`{_command(found)}`; {counted(len(found.rows), 'setting')}, "
        f"{counted(round(found.wall / 60.0), 'minute')}. Errors in percent: of the reference's own "
        "value for mean, deviations and uplift, of its standard deviation for maximum, minimum and "
        'the force "history" (rms). "est/true" is the error that a run estimates itself over the '
        'true one, "solves" those of the contact problem a step, "s/s" processor time of the '
        "march per simulated second, the least of those timed: only ratios within this page mean "
        "anything. Where step and mesh are refined together, errors of the history by the step and "
        "by the mesh alone stand beside the whole error, in which they may cancel.",
    ]
    if picture:
        parts.append(f"![work and precision]({picture})")
    parts.append("\n".join(f"- {sentence}" for sentence in sentences))
    for planned in found.plan.axes:
        axis, rows = planned.axis, found.rows_of(planned.axis.name)
        parts.append(f"## {capital(axis.title)}")
        if axis.kind == DISCRETISATION:
            doubt = uncertainty_text(planned, found.uncertainty[axis.name])
            parts.append(f"Reference: {run_in_words(planned.reference)}. {capital(doubt)}.")
        else:
            parts.append("Differences from the case as it is: of models, not errors.")
        parts.append(table_of(rows, axis).markdown())
        parts += [f"{capital(line)}." for line in order_lines(axis, rows)]
    remarks = remark_lines(runs_with_remarks(found))
    if remarks:
        parts.append("## Remarks")
        parts.append("\n".join(f"- {line.split(maxsplit=1)[1]}" for line in remarks))
    return "\n\n".join(parts) + "\n"


def _command(found: Measured) -> str:
    """The words that make this study again, the folder left out."""
    names = list(found.plan.asked)
    some = "" if names == list(AXES) else f" --axes {','.join(names)}"
    quick = " --quick" if found.plan.quick else ""
    repeats = "" if found.plan.repeats == _USUAL_REPEATS else f" --repeats {found.plan.repeats}"
    changes = "".join(f" --set {shlex.quote(one)}" for one in found.plan.overrides)
    return f"catenary accuracy {shlex.quote(found.plan.case)}{some}{quick}{repeats}{changes}"


def runs_with_remarks(found: Measured) -> list[tuple[str, Sequence[str]]]:
    """All runs in words, by the levels that they are of, with their remarks.

    A run of several axes has the words of each; one that is of none, such as a reference, has its
    own.
    """
    words: dict[str, list[str]] = {}
    for planned in found.plan.axes:
        for level, name in planned.runs.items():
            words.setdefault(name, []).append(f"{planned.axis.name} {in_words(level)}")
    own = {name: name.rpartition("__") for name in found.remarks}
    whole = {name: f"{axis} {in_words(level)}".strip() for name, (axis, _, level) in own.items()}
    return [
        (" or ".join(words.get(name, [whole[name]])), remarks)
        for name, remarks in found.remarks.items()
    ]


def uncertainty_text(planned: PlannedAxis, percent: Mapping[str, float]) -> str:
    """Sentence on the uncertainty of the reference of an axis, by quantity ``percent`` [%], and on
    the runs that it is known from."""
    chains = [", ".join(map(run_in_words, chain)) for chain in planned.chains]
    from_runs = " and from ".join(chains)
    known = {what: value for what, value in percent.items() if math.isfinite(value)}
    if not known:
        return f"the uncertainty of the reference is not known from {from_runs}"
    values = ", ".join(f"{what} {value:.3g}" for what, value in known.items())
    return f"uncertainty of the reference, from {from_runs} [%]: {values}"


def order_lines(axis: Axis, rows: Sequence[Row]) -> list[str]:
    """A line on the observed orders of each quantity that settings are chosen by."""
    lines = []
    for quantity in _ADVISED if axis.refined else ():
        orders = observed_orders(rows, axis.refined, quantity)
        if orders:
            values = ", ".join(f"{order:.2f}" for _, order in orders)
            lines.append(f"observed orders of {quantity}, from the coarsest on: {values}")
    return lines


def in_words(level: str) -> str:
    """A level's name as words: ``1_ms_1_elements`` is "1 ms 1 element"."""
    words = re.sub(r"\b1 elements\b", "1 element", level.replace("_", " "))
    return re.sub(r"\b([2-9]) mass\b", r"\1 masses", words)


def run_in_words(name: str) -> str:
    """The name of a run, axis and level, as that of its level alone."""
    return in_words(name.rpartition("__")[2])


def advices(found: Measured, target: float) -> list[str]:
    """A sentence for each quantity that settings are chosen by, on an error of at most ``target``
    [%]."""
    return [
        advice(
            found.rows_of(axis.name),
            quantity,
            target,
            found.uncertainty[axis.name][quantity],
            {"dt": "mesh", "h": "step"}.get(axis.refined, ""),
        )
        for axis in _precise(found)
        for quantity in _ADVISED
    ]


@figures.own_style()
def draw(found: Measured) -> Figure:
    """Error of the force history over the time of the march, with the Pareto front."""
    figure, axes = figures.panels(4.8)
    fronts = []
    for number, axis in enumerate(_precise(found)):
        rows = [row for row in found.rows_of(axis.name) if row.done and row.percent[HISTORY] > 0]
        front = [row for row in pareto(rows) if row.percent[HISTORY] > 0]
        for own, label, look in ((rows, axis.title, "o"), (front, "Pareto front", "-")):
            cost, percent = ([row.cost for row in own], [row.percent[HISTORY] for row in own])
            how = {"alpha": 0.5} if look == "o" else {}
            figures.curve(axes, cost, percent, number, label, look, 1.4, **how)
        fronts += front
    figures.log_log(axes)
    axes.margins(x=_MARGIN)
    _name(axes, fronts)
    figures.tidy(
        axes,
        "processor time of the march per simulated second [s/s]",
        "error of the force history, 0-20 Hz [% of sigma]",
        f"{found.plan.case}: accuracy and cost",
    )
    figures.legend_above(axes, columns=4)
    return figure


def _name(axes: Axes, rows: Sequence[Row]) -> None:
    """Name settings beside their points, the most costly first, where there is room."""
    named: list[np.ndarray] = []
    for row in sorted(rows, key=lambda row: -row.cost):
        point = row.cost, row.percent[HISTORY]
        place = axes.transData.transform(point)
        if any((np.abs(place - other) < _ROOM).all() for other in named):
            continue
        named.append(place)
        text = row.level.replace("_elements", "").replace("_ms_", " ms, ").replace("_", " ")
        # No setting is both cheaper and more accurate than one of the front: there is room.
        how: dict[str, Any] = {"ha": "right", "va": "top", "fontsize": "x-small"}
        axes.annotate(text, point, textcoords="offset points", xytext=(-4, -3), **how)


def _precise(found: Measured) -> list[Axis]:
    """The axes whose settings are chosen from: step and mesh together, else what there is."""
    axes = [planned.axis for planned in found.plan.axes if planned.axis.kind == DISCRETISATION]
    together = [axis for axis in axes if axis.name == "grid"]
    return together or [axis for axis in axes if axis.refined]


def _record(found: Measured, target: float) -> dict[str, Any]:
    axes = []
    for planned in found.plan.axes:
        axis, rows = planned.axis, found.rows_of(planned.axis.name)
        size = axis.refined
        axes.append(
            {name: getattr(axis, name) for name in ("name", "title", "kind")}
            | {
                "reference": planned.reference,
                "reference_chains": planned.chains,
                "reference_uncertainty_percent": found.uncertainty.get(axis.name),
                "orders": {q: observed_orders(rows, size, q) for q in _ADVISED} if size else {},
                "pareto": [row.level for row in pareto(rows)],
            }
        )
    return {
        "case": found.plan.case,
        "scene": found.plan.scene,
        "target_percent": target,
        "advice": advices(found, target),
        "wall_s": found.wall,
        "axes": axes,
        "rows": table_of(found.rows).records(),
        "remarks": {name: list(texts) for name, texts in found.remarks.items() if texts},
    }
