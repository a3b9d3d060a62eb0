"""What a sweep leaves: a table as CSV, JSON and text, and statistics drawn over what was varied."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from catenary.cases.scene.input.toml_input import REMOVED, parse_assignment
from catenary.cases.studies.sweep.axis_words import (
    STATISTICS_IN_WORDS,
    key_in_words,
    value_in_words,
)
from catenary.cases.studies.sweep.jobs import LINE_COLUMNS, PANTOGRAPH_COLUMNS, Ended
from catenary.cases.studies.sweep.variants import NAMES
from catenary.cases.studies.told_remarks import remark_lines
from catenary.postproc.evaluate.wording import fixed
from catenary.postproc.files.csv_text import csv_text, number_text
from catenary.postproc.files.disk import plain, write_all
from catenary.postproc.report.pictures import figures

TABLE, RECORD, PICTURE = "sweep.csv", "sweep.json", "sweep.png"
PLOTTED = ("mean_N", "std_N", "max_N", "min_N", "max_uplift_mm")
_MOST_LABELS = 10  # curves that a legend can name


def rows(ended: Sequence[Ended]) -> list[dict[str, Any]]:
    """One row per variant and pantograph; a variant that broke has one without figures.

    Columns: ``variant``, the varied keys with values of their own types, ``outcome``,
    ``pantograph``, ``STATISTICS``, ``passed`` (the standard's verdict, None if not judged),
    ``failed`` (the criteria that failed), ``remarks`` (what decides the results), ``wall_s``.
    """
    keys = varied_keys(ended)
    table = []
    for one in ended:
        head = {"variant": one.variant.name}
        head |= {key: _typed(key, one.variant.varied.get(key)) for key in keys}
        head["outcome"] = one.outcome
        tail: dict[str, Any] = {
            "passed": one.summary.get("passed"),
            "failed": failed_criteria(one.summary),
            "remarks": one.remarks,
            "wall_s": one.wall,
        }
        for pantograph in one.summary.get("pantographs", [{}]):
            row: dict[str, Any] = {**head, "pantograph": pantograph.get("name", "")}
            row |= {name: pantograph.get(name) for name in PANTOGRAPH_COLUMNS}
            row |= _of_line(one.summary)
            table.append(row | tail)
    return table


def _typed(key: str, text: str | None) -> Any:
    """The value that a varied key takes, as a scene reads it; None if the variant has none."""
    if text is None or key == NAMES:
        return text
    value = parse_assignment(f"{key}={text}", "--vary")[1]
    return None if value is REMOVED else value


def failed_criteria(summary: Mapping[str, Any]) -> list[str]:
    """Names of the acceptance criteria that a run failed, each once."""
    rows = summary.get("acceptance", [])
    return list(dict.fromkeys(row["criterion"] for row in rows if row["passed"] is False))


def _of_line(summary: dict[str, Any]) -> dict[str, Any]:
    droppers = summary.get("droppers", {})
    values = (
        summary.get("supports", {}).get("max_uplift_mm"),
        droppers.get("n_slackened"),
        droppers.get("max_force_N"),
        droppers.get("min_force_N"),
    )
    return dict(zip(LINE_COLUMNS, values, strict=True))


def varied_keys(ended: Sequence[Ended]) -> list[str]:
    """Keys that any of the variants varies, in the order of their first appearance."""
    return list(dict.fromkeys(key for one in ended for key in one.variant.varied))


def as_csv(table: Sequence[dict[str, Any]]) -> str:
    """The rows as CSV text; what is unknown is empty. ``table`` has at least one row."""
    heads = list(table[0])
    return csv_text(heads, ([_cell(row[key]) for key in heads] for row in table))


def _cell(value: Any) -> Any:
    if value is None:
        return ""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, list) and all(isinstance(entry, str) for entry in value):
        return "; ".join(value)
    if isinstance(value, list | dict):
        return json.dumps(value)
    return number_text(value) if isinstance(value, float) else value


def as_text(ended: Sequence[Ended]) -> str:
    """The table for a terminal: the most important figures."""
    width = max(len(one.variant.name) for one in ended)
    lines = [
        f"{'variant':{width}}  {'pantograph':12}{'mean':>8}{'std':>8}{'max':>8}{'min':>8}  [N]"
        f"{'loss [%]':>10}{'uplift [mm]':>13}{'slackened':>11}  accepted"
    ]
    for row in rows(ended):
        if row["outcome"] != "done":
            lines.append(f"{row['variant']:{width}}  BROKE: {row['outcome']}")
            continue
        forces = "".join(
            f"{_short(row[name]):>8}" for name in ("mean_N", "std_N", "max_N", "min_N")
        )
        lines.append(
            f"{row['variant']:{width}}  {row['pantograph']:12}{forces}     "
            f"{_short(row['loss_percent'], 3):>10}{_short(row['max_uplift_mm']):>13}"
            f"{_short(row['n_slackened'], 0):>11}  {_verdict(row)}"
        )
    return "\n".join([*lines, *remarks_of(ended)])


def remarks_of(ended: Sequence[Ended]) -> list[str]:
    """Lines of remarks on the variants, each once with those that it is of."""
    return remark_lines((one.variant.name, one.remarks) for one in ended)


def _verdict(row: Mapping[str, Any]) -> str:
    if row["failed"]:
        return f"FAILED {', '.join(row['failed'])}"
    return "passed" if row["passed"] else "not judged"


def _short(value: float | None, digits: int = 1) -> str:
    return "-" if value is None else fixed(value, digits)


def write(out_dir: Path, case: str, ended: Sequence[Ended], plotted: Sequence[str]) -> list[Path]:
    """Write table, record and picture of a sweep; returns the files. Not collective.

    The picture is left out if fewer than two variants are done.
    """
    table = rows(ended)
    record = {
        "case": case,
        "varied": varied_keys(ended),
        "wall_s": sum(one.wall for one in ended),
        "variants": [
            {"name": one.variant.name, "assignments": one.variant.assignments} for one in ended
        ],
        "rows": table,
    }
    content: dict[str, bytes | str] = {
        TABLE: as_csv(table),
        RECORD: json.dumps(plain(record), indent=1, ensure_ascii=False) + "\n",
    }
    if sum(one.done for one in ended) > 1:
        content |= figures.painted(PICTURE, lambda: draw(table, varied_keys(ended), plotted))
    return write_all(out_dir, content)


@figures.own_style()
def draw(table: Sequence[dict[str, Any]], keys: Sequence[str], plotted: Sequence[str]) -> Figure:
    """Statistics over the first varied key with numbers, a curve for each value of the others.

    Parameters
    ----------
    table : what ``rows`` gives, at least one row done
    keys : varied keys; without any the variants' names stand on the axis
    plotted : names out of ``STATISTICS``
    """
    done = [row for row in table if row["outcome"] == "done"]
    key = next((k for k in keys if all(_is_number(row[k]) for row in done)), None)
    axis = key or (keys[0] if keys else "variant")
    others = [k for k in keys if k != axis]
    curves: dict[str, list[dict[str, Any]]] = {}
    for row in done:
        label = ", ".join(value_in_words(k, row[k]) for k in others)
        label = ", ".join(part for part in (row["pantograph"], label) if part)
        curves.setdefault(label, []).append(row)
    places = list(dict.fromkeys(_cell(row[axis]) for row in done))
    figure = figures.new_figure(0.6 + 2.0 * len(plotted))
    panels = figure.subplots(len(plotted), 1, sharex=True, squeeze=False)[:, 0]
    for name, axes in zip(plotted, panels, strict=True):
        for number, (label, own) in enumerate(curves.items()):
            x = [float(row[axis]) if key else places.index(_cell(row[axis])) for row in own]
            y = [np.nan if row[name] is None else float(row[name]) for row in own]
            order = np.argsort(x, kind="stable")
            axes.plot(
                np.array(x)[order],
                np.array(y)[order],
                "o-",
                ms=4,
                linewidth=1.3,
                color=figures.colour(number),
                label=label,
            )
        figures.tidy(axes, "", STATISTICS_IN_WORDS[name])
    if len(curves) <= _MOST_LABELS:
        figures.legend_above(panels[0], columns=min(len(curves), 3))
    if key is None:
        panels[-1].set_xticks(range(len(places)), places, rotation=30, ha="right")
    panels[-1].set_xlabel(key_in_words(axis))
    return figure


def _is_number(value: Any) -> bool:
    real = isinstance(value, int | float) and not isinstance(value, bool)
    return real and bool(np.isfinite(value))
