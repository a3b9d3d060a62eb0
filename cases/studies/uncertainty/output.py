"""What an evaluation leaves: JSON, pictures, and sections of text for a terminal."""

from __future__ import annotations

import functools
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from catenary.cases.studies.sweep.jobs import STATISTICS
from catenary.cases.studies.uncertainty import pictures
from catenary.cases.studies.uncertainty.evaluation import Row, Uncertainty
from catenary.cases.studies.uncertainty.run_table import (
    SAMPLING,
    RunTable,
    sampling_text,
)
from catenary.postproc.files.disk import plain, write_all
from catenary.postproc.report.pictures import figures
from catenary.postproc.report.study_table import Column, StudyTable

RECORD = "uncertainty.json"
PICTURES = {
    "uncertainty_scatter.png": pictures.scatter,
    "uncertainty_parallel.png": pictures.parallel_coordinates,
    "uncertainty_convergence.png": pictures.convergence,
    "uncertainty_histogram.png": pictures.histograms,
}
_LOW, _HIGH = 0.05, 0.95
_MOST_REMARKS = 5  # on a terminal; all are in the file


def write(
    out: Path, table: RunTable, found: Uncertainty, plotted: Sequence[str] = ()
) -> list[Path]:
    """Write an evaluation, its pictures and the sampling; returns the files. Not collective.

    Parameters
    ----------
    out : folder
    table : the runs
    found : their evaluation
    plotted : statistics that are drawn; the usual ones if there are none
    """
    content: dict[str, bytes | str] = {
        RECORD: json.dumps(plain(found.as_table()), indent=1, ensure_ascii=False) + "\n"
    }
    if table.sampling is not None:
        content[SAMPLING] = sampling_text(table.sampling)
    for name, draw in PICTURES.items():
        content |= figures.painted(name, functools.partial(draw, table, plotted))
    return write_all(out, content)


def as_text(found: Uncertainty) -> str:
    """Tables for a terminal: statistics with quantiles, probabilities, indices, notes."""
    parts = []
    if found.statistics:
        parts.append(_statistics(found).text())
    if found.probabilities:
        parts.append(
            "Probability that a criterion fails, with 95 % bounds (Clopper-Pearson)\n"
            + _probabilities(found).text()
        )
    shown = [row for row in found.sensitivity if "with" not in row and _is_shown(row)]
    if shown:
        parts.append(_first_letter(found.method) + "\n" + _indices(shown).text())
    told = found.remarks[:_MOST_REMARKS]
    lines = [f"REMARK      {one['n']} of {found.n_runs} runs: {one['remark']}" for one in told]
    lines += [f"NOTE        {note}" for note in found.notes]
    return "\n\n".join([*parts, *(["\n".join(lines)] if lines else [])])


def _is_shown(row: Row) -> bool:
    """Whether a terminal shows a statistic's indices: of the columns that people read."""
    known = STATISTICS.get(row["statistic"])
    return known is None or bool(known.head)


def _statistics(found: Uncertainty) -> StudyTable:
    several = len({row["pantograph"] for row in found.statistics} - {""}) > 1
    columns = [
        Column("statistic", "statistic"),
        *([Column("pantograph", "pantograph")] if several else []),
        Column("n", "n", "d"),
        Column("mean", "mean", ".4g"),
        Column("mean_bounds", "95 %", ">"),
        Column("standard_deviation", "std", ".3g"),
        Column("low", f"q{100 * _LOW:g} %", ".4g"),
        Column("high", f"q{100 * _HIGH:g} %", ".4g"),
        Column("high_bounds", "95 %", ">"),
    ]
    quantiles = {
        (row["statistic"], row["pantograph"], row["probability"]): row for row in found.quantiles
    }
    rows = []
    for row in found.statistics:
        key = row["statistic"], row["pantograph"]
        low, high = quantiles[*key, _LOW], quantiles[*key, _HIGH]
        shown = {
            "mean_bounds": _bounds(row, "mean"),
            "low": low["value"],
            "high": high["value"],
            "high_bounds": _bounds(high, "value"),
        }
        rows.append(row | shown)
    return StudyTable(columns, rows)


def _probabilities(found: Uncertainty) -> StudyTable:
    columns = [
        Column("criterion", "criterion"),
        Column("failed", "failed", "d"),
        Column("n", "of", "d"),
        Column("probability", "probability", ".4g"),
        Column("bounds", "95 %", ">"),
    ]
    rows = [row | {"bounds": _bounds(row, "probability")} for row in found.probabilities]
    return StudyTable(columns, rows)


def _indices(shown: list[Row]) -> StudyTable:
    total = any("ST" in row for row in shown)
    several = len({row["pantograph"] for row in shown} - {""}) > 1
    columns = [
        Column("statistic", "statistic"),
        *([Column("pantograph", "pantograph")] if several else []),
        Column("key", "key"),
        Column("S1", "S1", ".2f"),
        Column("S1_conf", "+-", ".2f"),
        *([Column("ST", "ST", ".2f"), Column("ST_conf", "+-", ".2f")] if total else []),
        *([] if total else [Column("rank_correlation", "rank corr.", ".2f")]),
    ]
    rows = [{name: _known(value) for name, value in row.items()} for row in shown]
    return StudyTable(columns, rows)


def _known(value: Any) -> Any:
    """A cell's value, None where it is no number."""
    return None if value != value else value


def _bounds(row: Row, name: str) -> str:
    """Bounds of an estimate; a dash stands for one that too few samples leave open."""
    low, high = (row[f"{name}_{end}"] for end in ("low", "high"))
    return " to ".join("-" if one != one else f"{one:.4g}" for one in (low, high))


def _first_letter(text: str) -> str:
    return text[:1].upper() + text[1:]
