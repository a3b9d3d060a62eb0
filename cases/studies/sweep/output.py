"""Output of a sweep: a table as CSV, JSON and text, statistics over the varied keys, histograms.

Histograms of the contact forces have a row for each pantograph; a picture shows their spread.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from catenary.cases.scene.input.case_files import REMOVED, parse_assignment
from catenary.cases.scene.keys.keys import is_known
from catenary.cases.scene.keys.units import unit_of, without_unit
from catenary.cases.studies.sweep.jobs import STATISTICS, Ended, statistics_of
from catenary.cases.studies.sweep.sweep import RECORD
from catenary.cases.studies.sweep.variants import Variant, is_number
from catenary.cases.terminal.lists import keys_of_a_scene
from catenary.cases.terminal.terminal_text import labelled
from catenary.postproc.evaluate.statistics import HISTOGRAM_BIN
from catenary.postproc.report.pictures import figures
from catenary.postproc.report.study_table import (
    Column,
    Content,
    StudyTable,
    cell,
    file_table,
    remark_lines,
)

HISTOGRAM_TABLE, HISTOGRAM_PICTURE = "force_histogram.csv", "force_histogram.png"
_LOW, _HIGH = 0.05, 0.95  # quantiles of variants that a picture of histograms shows
TABLE, PICTURE = "sweep.csv", "sweep.png"
PARQUET = "sweep.parquet"
# Columns of what variants differ by and is no key: their names in a file, the train's direction.
NAMED, DIRECTION = "named", "direction"
PLOTTED = ("mean_N", "std_N", "max_N", "min_N", "max_uplift_mm")
_MOST_LABELS = 10  # curves that a legend can name
_LONGEST = 48  # a longer meaning of a key explains more than an axis has room for


def table_of(ended: Sequence[Ended]) -> StudyTable:
    """One row per variant and pantograph; a variant that broke has one without figures.

    Columns: ``variant`` (its name, as of its folder), ``named`` (its name in a file, if keys are
    varied beside it), the varied keys with values of their own types, ``outcome``, ``pantograph``,
    ``STATISTICS``, ``rules`` (the books that judge), ``passed`` (their verdict, None if not
    judged), ``failed`` (the criteria that failed), ``judged`` (all that were judged),
    ``not_judged`` (those without data), ``remarks`` (what decides the results), ``wall_s``.
    """
    keys = varied_keys(ended)
    rows = []
    for one in ended:
        head: dict[str, Any] = {"variant": one.variant.name, "outcome": one.outcome}
        head |= {**dict.fromkeys(keys), **_columns_of(one.variant)}
        failed = failed_criteria(one.summary)
        head |= {"passed": one.summary.get("passed"), "failed": failed, "remarks": one.remarks}
        head |= {"judged": _criteria(one.summary, (False, True))}
        unjudged = one.summary.get("not_judged", [])
        head["not_judged"] = list(dict.fromkeys(labelled(row, several=True) for row in unjudged))
        rules = [*one.summary.get("acceptance", []), *unjudged]
        head["rules"] = list(dict.fromkeys(row["book"] for row in rules if row.get("book")))
        verdict = "passed" if head["passed"] else "not judged"
        head["accepted"] = f"FAILED {'; '.join(failed)}" if failed else verdict
        head["wall_s"] = one.wall
        rows += [head | figures for figures in statistics_of(one.summary)]
    columns = [
        Column("variant", "variant"),
        *map(Column, keys),
        Column("outcome"),
        Column("pantograph", "pantograph"),
        *STATISTICS.values(),
        Column("accepted", "accepted", in_files=False),
        *(
            Column(name)
            for name in ("rules", "passed", "failed", "judged", "not_judged", "remarks", "wall_s")
        ),
    ]
    return StudyTable(columns, rows)


def _labels_of(variant: Variant) -> dict[str, str]:
    """Name in a file and direction of a variant, if it has them."""
    labels = {NAMED: variant.named, DIRECTION: variant.direction}
    return {name: text for name, text in labels.items() if text}


def _columns_of(variant: Variant) -> dict[str, Any]:
    """Columns that identify a variant: its labels, and the values of varied keys as a scene reads
    them."""
    columns: dict[str, Any] = dict(_labels_of(variant))
    for key, text in variant.varied.items():
        value = parse_assignment(f"{key}={text}", "--vary")[1]
        columns[key] = None if value is REMOVED else value
    return columns


def failed_criteria(summary: Mapping[str, Any]) -> list[str]:
    """Names of the acceptance criteria that a run failed, each once."""
    return _criteria(summary, (False,))


def _criteria(summary: Mapping[str, Any], verdicts: Sequence[bool]) -> list[str]:
    """Names of the criteria of a run with one of some verdicts, each once."""
    rows = summary.get("acceptance", [])
    several = len({row.get("book") for row in rows}) > 1
    return list(dict.fromkeys(labelled(row, several) for row in rows if row["passed"] in verdicts))


def varied_keys(ended: Sequence[Ended]) -> list[str]:
    """Columns that tell variants apart, varied keys foremost, as they first appear."""
    variants = (one.variant for one in ended)
    return list(dict.fromkeys(key for one in variants for key in (*_labels_of(one), *one.varied)))


def as_text(ended: Sequence[Ended]) -> str:
    """The table for a terminal: the most important figures, and the remarks on the variants."""
    return "\n".join([table_of(ended).text(), *remarks_of(ended)])


def remarks_of(ended: Sequence[Ended]) -> list[str]:
    """Lines of remarks on variants: each remark once, with the variants that have it."""
    return remark_lines((one.variant.name, one.remarks) for one in ended)


def files_of(
    case: str,
    ended: Sequence[Ended],
    plotted: Sequence[str] | None,
    histogram: bool = False,
    scene: Mapping[str, Any] | None = None,
) -> dict[str, Content]:
    """Table, record and picture of a sweep. Not collective.

    Parameters
    ----------
    case : name of the case
    ended : how each variant ended
    plotted : statistics in the picture, the usual ones if there are none, None for no picture;
        fewer than two variants that are done have none
    histogram : whether histograms of the contact forces are written too
    scene : tables of the case, from which variants differ; they go into the record
    """
    table = table_of(ended)
    record = {
        "case": case,
        "varied": varied_keys(ended),
        "wall_s": sum(one.wall for one in ended),
        "variants": [
            {"name": one.variant.name, "assignments": one.variant.assignments} for one in ended
        ],
        "rows": table.records(),
        "scene": json.loads(json.dumps(scene, default=str)),
    }
    content = table_files(record, table)
    if plotted is not None and sum(one.done for one in ended) > 1:
        content[PICTURE] = partial(
            draw_statistics, table.rows, varied_keys(ended), plotted or PLOTTED
        )
    if histogram:
        content |= _histogram_files(ended)
    return content


def table_files(record: Mapping[str, Any], table: StudyTable) -> dict[str, Content]:
    """The table of a sweep as CSV, as JSON within its record, and as Parquet with pyarrow."""
    files: dict[str, Content] = {TABLE: table, RECORD: record}
    columns = table.parquet()
    return files if columns is None else files | {PARQUET: columns}


@figures.own_style()
def draw_statistics(
    table: Sequence[Mapping[str, Any]], keys: Sequence[str], plotted: Sequence[str]
) -> Figure:
    """Statistics over the first varied key with numbers, a curve for each value of the others.

    Parameters
    ----------
    table : the rows of ``table_of``, at least one of them done
    keys : varied keys; without any the variants' names stand on the axis
    plotted : names out of ``STATISTICS``
    """
    done = [row for row in table if row["outcome"] == "done"]
    numbers = (k for k in keys if all(is_number(row[k]) and np.isfinite(row[k]) for row in done))
    key = next(numbers, None)
    axis = key or (keys[0] if keys else "variant")
    others = [k for k in keys if k != axis]
    curves: dict[str, list[Mapping[str, Any]]] = {}
    for row in done:
        label = ", ".join(value_in_words(k, row[k]) for k in others)
        label = ", ".join(part for part in (row["pantograph"], label) if part)
        curves.setdefault(label, []).append(row)
    places = list(dict.fromkeys(cell(row[axis]) for row in done))
    figure = figures.new_figure(0.6 + 2.0 * len(plotted))
    panels = figure.subplots(len(plotted), 1, sharex=True, squeeze=False)[:, 0]
    for name, axes in zip(plotted, panels, strict=True):
        for number, (label, own) in enumerate(curves.items()):
            x = [float(row[axis]) if key else places.index(cell(row[axis])) for row in own]
            y = [np.nan if row[name] is None else float(row[name]) for row in own]
            order = np.argsort(x, kind="stable")
            look = figures.mark(number) + figures.line(number)
            figures.curve(axes, np.array(x)[order], np.array(y)[order], number, label, look)
        figures.tidy(axes, "", figures.wrapped(STATISTICS[name].meaning))
    if len(curves) <= _MOST_LABELS:
        figures.legend_above(panels[0], columns=min(len(curves), 3))
    if key is None:
        panels[-1].set_xticks(range(len(places)), places, rotation=30, ha="right")
    panels[-1].set_xlabel(key_in_words(axis))
    return figure


def key_in_words(key: str) -> str:
    """Meaning of a dotted key, with its table and unit: ``contact wire: tension [N]``."""
    parts = [part for part in key.split(".") if not part.isdigit()]
    known = next((one for one in keys_of_a_scene() if is_known(key, (one.name,))), None)
    is_short = known is not None and len(known.meaning) <= _LONGEST
    meaning = known.meaning if known is not None and is_short else _spaced(parts[-1])
    tables = [_spaced(part) for part in parts[1 if is_short or len(parts) > 2 else 0 : -1]]
    unit = unit_of(key)
    words = f"{', '.join(tables)}: {meaning}" if tables else meaning
    return f"{words} [{unit}]" if unit else words


def value_in_words(key: str, value: Any) -> str:
    """A key's last part with its value and unit: ``speed 250 km/h``."""
    name = _spaced(key.rsplit(".", 1)[-1])
    text = str(value).lower() if isinstance(value, bool) else str(value)
    return f"{name} {text} {unit_of(key)}".rstrip()


def _spaced(name: str) -> str:
    """A name as it is written in code, without its unit and with spaces."""
    return without_unit(name).replace("_", " ")


def force_histograms(ended: Sequence[Ended]) -> pd.DataFrame | None:
    """Share of time in bins of the filtered contact force [%]; None if no variant has some.

    A row for each variant and pantograph, a column for each bin under its lower edge [N].
    Pantographs without statistics have none. Left out too are those whose force spans so much,
    above 10 kN, that their bins are wider than others.
    """
    known = {
        (one.variant.name, own["name"]): own
        for one in ended
        for own in one.summary.get("histograms", [])
        if own["bin_N"] == HISTOGRAM_BIN
    }
    if not known:
        return None
    starts = [round(own["from_N"] / HISTOGRAM_BIN) for own in known.values()]
    shares = [own["percent"] for own in known.values()]
    first = min(starts)
    last = max(start + len(share) for start, share in zip(starts, shares, strict=True))
    percent = np.zeros((len(known), last - first))
    for row, start, share in zip(percent, starts, shares, strict=True):
        row[start - first :][: len(share)] = share
    rows = pd.MultiIndex.from_tuples(known, names=("variant", "pantograph"))
    return pd.DataFrame(percent, rows, HISTOGRAM_BIN * np.arange(first, last))


def _histogram_files(ended: Sequence[Ended]) -> dict[str, Content]:
    """Table and picture of the histograms of a sweep, nothing if there are none."""
    found = force_histograms(ended)
    if found is None:
        return {}
    heads = [*found.index.names, *(f"from_{edge:g}_N" for edge in found.columns)]
    rows = ([*own, *row] for own, row in zip(found.index, found.to_numpy().tolist(), strict=True))
    return {
        HISTOGRAM_TABLE: file_table(heads, rows),
        HISTOGRAM_PICTURE: lambda: _draw_histograms(found),
    }


@figures.own_style()
def _draw_histograms(found: pd.DataFrame) -> Figure:
    """The mean share of time in each bin, and between which shares 90 % of the variants lie."""
    figure = figures.new_figure(3.4)
    axes = figure.subplots()
    edges = [*found.columns, found.columns[-1] + HISTOGRAM_BIN]
    for number, (name, own) in enumerate(found.groupby("pantograph", sort=False)):
        colour = figures.colour(number)
        low, high = np.quantile(own, (_LOW, _HIGH), axis=0)
        axes.stairs(high, edges, baseline=low, fill=True, color=colour, alpha=0.25)
        look = figures.line(number)
        axes.stairs(own.mean(axis=0), edges, color=colour, linestyle=look, label=name)
    figures.tidy(axes, "filtered contact force, 0-20 Hz [N]", "share of time [%]")
    axes.set_title("line: mean of all variants, band: 5 to 95 % of them", loc="left")
    figures.legend_above(axes)
    return figure
