"""What an accuracy study leaves: tables as CSV, JSON and text, the work-precision diagram."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from catenary.cases.studies.accuracy import markdown as accuracy_markdown
from catenary.cases.studies.accuracy.analysis import (
    HISTORY,
    QUANTITIES,
    Row,
    advice,
    observed_orders,
    pareto,
)
from catenary.cases.studies.accuracy.axis import DISCRETISATION, Axis
from catenary.cases.studies.accuracy.markdown import (
    run_in_words,
    runs_with_remarks,
    uncertainty_text,
)
from catenary.cases.studies.accuracy.runs import Measured
from catenary.cases.studies.sweep import output as sweep_output
from catenary.cases.studies.told_remarks import remark_lines
from catenary.postproc.files.disk import plain, write_all
from catenary.postproc.report.pictures import figures

TABLE, RECORD, PAGE = "accuracy.csv", "accuracy.json", "accuracy.md"
PICTURE = "work_precision.png"
_ADVISED = ("std", HISTORY)
# Width and height that a name takes in the diagram, in its pixels.
_ROOM = np.array([50.0, 12.0])
# Share of the axis beside the outermost points, for their names.
_MARGIN = 0.09


def write(found: Measured, out_dir: Path, target: float) -> list[Path]:
    """Write table, record, page and diagram; returns the files. Not collective.

    The diagram is left out if no axis of discretisation was varied.
    """
    content: dict[str, bytes | str] = {
        TABLE: sweep_output.as_csv([as_table(row) for row in found.rows]),
        RECORD: json.dumps(plain(_record(found, target)), indent=1, ensure_ascii=False) + "\n",
    }
    if any(row.done for axis in _precise(found) for row in found.rows_of(axis.name)):
        content |= figures.painted(PICTURE, lambda: draw(found))
    orders = {
        planned.axis.name: _order_lines(planned.axis, found.rows_of(planned.axis.name))
        for planned in found.plan.axes
    }
    picture = PICTURE if PICTURE in content else ""
    content[PAGE] = accuracy_markdown.page(found, advices(found, target), orders, picture)
    return write_all(out_dir, content)


def as_table(row: Row) -> dict[str, Any]:
    """A row under names with units; what is unknown is None."""
    table: dict[str, Any] = {"axis": row.axis, "level": row.level, "outcome": row.outcome}
    table["dt_s"] = row.sizes.get("dt")
    h = row.sizes.get("h")
    table["elements_per_gap"] = None if h is None else round(1.0 / h)
    for name, quantity in QUANTITIES.items():
        table[f"error_{name}_{quantity.unit}"] = row.errors.get(name)
        table[f"error_{name}_percent"] = row.percent.get(name)
    for name in _ADVISED:
        table[f"error_{name}_by_step_percent"] = row.by_step.get(name)
        table[f"error_{name}_by_mesh_percent"] = row.by_mesh.get(name)
    table["estimated_history_N"] = _known(row.estimate)
    table["rounds_per_step"] = _known(row.iterations)
    table["march_s_per_s"] = _known(row.cost)
    table["n_timed"] = row.timings
    table["remarks"] = list(row.remarks)
    return table


def as_text(found: Measured, target: float) -> str:
    """All tables for a terminal, orders and advice."""
    parts = []
    for planned in found.plan.axes:
        axis, rows = planned.axis, found.rows_of(planned.axis.name)
        parts.append(_axis_text(axis, planned.reference, rows))
        if axis.kind == DISCRETISATION:
            parts.append(f"  {uncertainty_text(planned, found.uncertainty[axis.name])}")
        parts += _order_lines(axis, rows)
        parts.append("")
    return "\n".join([*parts, *advices(found, target), *remark_lines(runs_with_remarks(found))])


def advices(found: Measured, target: float) -> list[str]:
    """A sentence for each quantity that settings are chosen by."""
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
    figure = figures.new_figure(4.8)
    axes = figure.subplots()
    fronts = []
    for number, axis in enumerate(_precise(found)):
        rows = [row for row in found.rows_of(axis.name) if row.done and row.percent[HISTORY] > 0]
        colour = figures.colour(number)
        axes.plot(
            [row.cost for row in rows],
            [row.percent[HISTORY] for row in rows],
            "o",
            ms=4,
            color=colour,
            alpha=0.5,
            label=axis.title,
        )
        front = [row for row in pareto(rows) if row.percent[HISTORY] > 0]
        axes.plot(
            [row.cost for row in front],
            [row.percent[HISTORY] for row in front],
            "-",
            linewidth=1.4,
            color=colour,
            label="Pareto front",
        )
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
        axes.annotate(text, point, textcoords="offset points", xytext=(5, 4), fontsize="x-small")


def _precise(found: Measured) -> list[Axis]:
    """The axes whose settings are chosen from: step and mesh together, else what there is."""
    axes = [planned.axis for planned in found.plan.axes if planned.axis.kind == DISCRETISATION]
    together = [axis for axis in axes if axis.name == "grid"]
    return together or [axis for axis in axes if axis.refined]


def _record(found: Measured, target: float) -> dict[str, Any]:
    axes = []
    for planned in found.plan.axes:
        rows = found.rows_of(planned.axis.name)
        size = planned.axis.refined
        axes.append(
            {
                "name": planned.axis.name,
                "title": planned.axis.title,
                "kind": planned.axis.kind,
                "reference": planned.reference,
                "reference_chains": planned.chains,
                "reference_uncertainty_percent": found.uncertainty.get(planned.axis.name),
                "orders": {q: observed_orders(rows, size, q) for q in _ADVISED} if size else {},
                "pareto": [row.level for row in pareto(rows)],
            }
        )
    return {
        "case": found.plan.case,
        "target_percent": target,
        "advice": advices(found, target),
        "wall_s": found.wall,
        "axes": axes,
        "rows": [as_table(row) for row in found.rows],
        "remarks": {name: list(told) for name, told in found.remarks.items() if told},
    }


def _axis_text(axis: Axis, reference: str, rows: Sequence[Row]) -> str:
    what = "error against" if axis.kind == DISCRETISATION else "difference of models from"
    if axis.kind != DISCRETISATION:
        reference = "the case as it is"
    reference = run_in_words(reference)
    width = max(len(row.level) for row in rows)
    names = list(QUANTITIES)
    head = "".join(f"{name:>9}" for name in names)
    both = any(row.by_step for row in rows)
    head += f"{'by step':>9}{'by mesh':>9}" if both else ""
    lines = [
        f"{axis.title}: {what} {reference} [%]",
        f"  {'':{width}}{head}{'est/true':>10}{'solves':>8}{'s/s':>9}{'remarks':>9}",
    ]
    for row in rows:
        if not row.done:
            lines.append(f"  {row.level:{width}}  {row.outcome}")
            continue
        figures = "".join(f"{_short(row.percent.get(name)):>9}" for name in names)
        if both:
            alone = (row.by_step.get(HISTORY), row.by_mesh.get(HISTORY))
            figures += "".join(f"{_short(value):>9}" for value in alone)
        true = row.errors.get(HISTORY, math.nan)
        ratio = row.estimate / true if axis.refined == "dt" and true else math.nan
        lines.append(
            f"  {row.level:{width}}{figures}{_short(_known(ratio)):>10}{row.iterations:>8.2f}"
            f"{row.cost:>9.4f}{len(row.remarks):>9}"
        )
    return "\n".join(lines)


def _order_lines(axis: Axis, rows: Sequence[Row]) -> list[str]:
    if not axis.refined:
        return []
    lines = []
    for quantity in _ADVISED:
        orders = observed_orders(rows, axis.refined, quantity)
        if orders:
            told = ", ".join(f"{order:.2f}" for _, order in orders)
            lines.append(f"  observed orders of {quantity}, from the coarsest on: {told}")
    return lines


def _known(value: float) -> float | None:
    return None if math.isnan(value) else value


def _short(value: float | None) -> str:
    return "-" if value is None else f"{value:.3g}"
