"""Output of an evaluation: JSON, pictures, and sections of text for a terminal."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter

from catenary.cases.studies.sweep.jobs import STATISTICS
from catenary.cases.studies.sweep.output import PLOTTED, key_in_words
from catenary.cases.studies.uncertainty.evaluation import (
    Row,
    Uncertainty,
    evaluate,
    independent_runs,
    quantile,
    ranked_inputs,
    student,
)
from catenary.cases.studies.uncertainty.run_table import RunTable, run_table, sampling_file
from catenary.cases.studies.uncertainty.sampling import SamplingTable
from catenary.postproc.evaluate.wording import capital
from catenary.postproc.report.pictures import figures
from catenary.postproc.report.study_table import Column, Content, StudyTable, alike, write_files

# Panels, points and lines that a picture has room for.
_MOST_KEYS, _MOST_STATISTICS, _MOST_POINTS, _MOST_LINES = 6, 5, 5000, 1000
_LOW, _HIGH = 0.05, 0.95  # quantiles that are drawn and printed
# Statistics of which the low quantile is the adverse one: little of them is bad.
_BAD_IF_LOW = ("min_N", "stat_min_N", "min_dropper_force_N")
_MANY = 300  # points that are drawn small
_MOST_TICKS = 10  # along a row of panels
_WIDTH_OF_LABEL, _WIDTH_OF_ALL = 23, 100  # characters of a line: of a label, of all in a row
_STEPS, _LEAST_SAMPLES = 25, 10  # points of a curve of convergence, and where it begins
_ADVERSE = f"{100 * _HIGH:g} % quantile, of minima {100 * _LOW:g} %"
_SEED = 1  # of the choice of rows that are drawn


def drawn_statistics(table: RunTable, wanted: Sequence[str] = ()) -> list[str]:
    """The statistics that are drawn: the wanted ones, else the usual ones, else the first."""
    usual = [name for name in wanted or PLOTTED if name in table.statistics]
    return usual or table.statistics[:_MOST_STATISTICS]


def adverse_probability(name: str) -> float:
    """Probability of the quantile at the adverse end of a statistic."""
    return _LOW if name in _BAD_IF_LOW else _HIGH


def worst_pantograph(table: RunTable, name: str) -> tuple[str, pd.DataFrame]:
    """Pantograph whose statistic has the worst adverse quantile, and its rows with the statistic.

    Returns
    -------
    str
        Its name; empty for a statistic of the line.
    DataFrame
        Its rows, in the order of the table.
    """
    known = {one: rows[rows[name].notna()] for one, rows in table.of(name).items()}
    probability = adverse_probability(name)
    sign = -1.0 if probability == _LOW else 1.0
    worst = max(known, key=lambda one: sign * known[one][name].quantile(probability))
    return worst, known[worst]


def _some(rows: pd.DataFrame, most: int) -> pd.DataFrame:
    """Rows, or ``most`` of them at random, in their order. Every k-th of Sobol points or of
    Saltelli's blocks would leave out parts of the space."""
    if len(rows) <= most:
        return rows
    chosen = np.random.default_rng(_SEED).choice(len(rows), most, replace=False)
    return rows.iloc[np.sort(chosen)]


@figures.own_style()
def scatter(table: RunTable, wanted: Sequence[str] = ()) -> Figure | None:
    """Statistics over each input, a row of panels for each statistic; None without inputs."""
    keys, statistics = ranked_inputs(table)[:_MOST_KEYS], drawn_statistics(table, wanted)
    if not keys or not statistics:
        return None
    figure = figures.new_figure(0.6 + 1.9 * len(statistics))
    panels = figure.subplots(len(statistics), len(keys), sharex="col", sharey="row", squeeze=False)
    for row, name in zip(panels, statistics, strict=True):
        for axes, key in zip(row, keys, strict=True):
            for number, (pantograph, rows) in enumerate(table.of(name).items()):
                some = _some(rows, _MOST_POINTS)
                figures.curve(
                    axes, some[key], some[name], number, pantograph or None, figures.mark(number),
                    ms=4.0 if len(some) < _MANY else 1.5, alpha=0.6, mew=0.0,
                )  # fmt: skip
            _panel(axes, "", _meaning(name) if key == keys[0] else "")
    most = max(2, _MOST_TICKS // len(keys))
    for axes, key in zip(panels[-1], keys, strict=True):
        axes.xaxis.set_major_locator(figures.FewTicks(most, steps=figures.STEPS))
        axes.set_xlabel(_beside(key_in_words(key), len(keys)), fontsize="small")
    if len(table.of(statistics[0])) > 1:
        legend = figures.legend_above(panels[0][-1])
        for handle in legend.get_lines():
            handle.set(markersize=4.0, alpha=1.0)
    return figure


@figures.own_style()
def parallel_coordinates(table: RunTable, wanted: Sequence[str] = ()) -> Figure | None:
    """A line for each run through its inputs and a statistic, by which it is coloured.

    Independent samples only, of the worst pantograph. Each axis runs from the least to the greatest
    value. None with fewer than two axes.
    """
    table = independent_runs(table)
    keys, statistics = ranked_inputs(table), drawn_statistics(table, wanted)
    if not keys or not statistics:
        return None
    name = "std_N" if "std_N" in statistics else statistics[0]
    pantograph, rows = worst_pantograph(table, name)
    axes_names = [*keys[:_MOST_KEYS], name]
    numbers = _some(rows[axes_names].dropna(), _MOST_LINES).to_numpy(float)
    if len(numbers) < 2:
        return None
    low, high = numbers.min(axis=0), numbers.max(axis=0)
    scaled = (numbers - low) / np.where(high > low, high - low, 1.0)
    figure = figures.new_figure(3.6)
    axes = figure.subplots()
    x = np.arange(len(axes_names))
    order = np.argsort(scaled[:, -1])
    lines = LineCollection(
        [np.column_stack([x, own]) for own in scaled[order]],
        array=numbers[order, -1], cmap="viridis", linewidths=0.7, alpha=0.7,
    )  # fmt: skip
    axes.add_collection(lines)
    figure.colorbar(lines, ax=axes, label=_meaning(name), pad=0.02)
    axes.set_xlim(-0.2, len(x) - 0.8)
    axes.set_ylim(-0.02, 1.02)
    axes.set_yticks([])
    meanings = [*map(key_in_words, axes_names[:-1]), _meaning(name)]
    labels = [
        f"{a:.5g} to {b:.5g}\n{_beside(meaning, len(meanings))}"
        for meaning, a, b in zip(meanings, low, high, strict=True)
    ]
    axes.set_xticks(x, labels, fontsize="small")
    for place in x:
        axes.axvline(place, color=figures.GREY, linewidth=0.8)
    for side in ("top", "right", "left"):
        axes.spines[side].set_visible(False)
    if pantograph and len(table.of(name)) > 1:
        axes.set_title(pantograph, loc="left", fontsize="medium")
    return figure


@figures.own_style()
def convergence(table: RunTable, wanted: Sequence[str] = ()) -> Figure | None:
    """Mean and adverse quantile with their bounds over the number of samples; None of fewer than
    10.

    Samples are taken in their order, independent ones only, of the worst pantograph.
    """
    table = independent_runs(table)
    worst = {name: worst_pantograph(table, name) for name in drawn_statistics(table, wanted)}
    samples = {name: rows[name].to_numpy(float) for name, (_, rows) in worst.items()}
    samples = {name: x for name, x in samples.items() if len(x) >= _LEAST_SAMPLES}
    if not samples:
        return None
    figure = figures.new_figure(0.6 + 2.0 * len(samples))
    panels = figure.subplots(len(samples), 1, sharex=True, squeeze=False)[:, 0]
    for axes, (name, x) in zip(panels, samples.items(), strict=True):
        counts = np.unique(np.geomspace(_LEAST_SAMPLES, len(x), _STEPS).round().astype(int))
        means = np.array([student(x[:n]) for n in counts])
        adverse = np.array([quantile(x[:n], adverse_probability(name)) for n in counts])
        for number, (label, found) in enumerate((("mean", means), (_ADVERSE, adverse))):
            mark = figures.mark(number)
            figures.curve(axes, counts, found[:, 0], number, label, f"{mark}-")
            for bound in (found[:, 1], found[:, 2]):
                figures.curve(axes, counts, bound, number, None, f"{mark}--", 0.7, ms=2.0)
        several = len(table.of(name)) > 1
        _panel(axes, "", _meaning(name), f"{worst[name][0]}, the worst one" if several else "")
    panels[-1].set_xlabel("number of samples; dashed: 95 % confidence", fontsize="small")
    panels[-1].set_xscale("log")
    panels[-1].xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    panels[-1].xaxis.set_major_formatter("{x:g}")
    panels[-1].xaxis.set_minor_formatter(NullFormatter())
    figures.legend_above(panels[0])
    return figure


@figures.own_style()
def histograms(table: RunTable, wanted: Sequence[str] = ()) -> Figure | None:
    """Histogram of each statistic with its median and adverse quantile; None without any."""
    table = independent_runs(table)
    statistics = drawn_statistics(table, wanted)
    if not statistics:
        return None
    figure = figures.new_figure(0.6 + 1.8 * len(statistics))
    panels = figure.subplots(len(statistics), 1, squeeze=False)[:, 0]
    for axes, name in zip(panels, statistics, strict=True):
        for number, (pantograph, rows) in enumerate(table.of(name).items()):
            x = rows[name].dropna().to_numpy(float)
            # The bins of Freedman and Diaconis, but no more than are seen.
            bins = min(60, len(np.histogram_bin_edges(x, "fd")))
            colour = figures.colour(number)
            bars: dict[str, Any] = {"color": colour, "alpha": 0.5, "edgecolor": "white"}
            bars |= {"hatch": figures.hatch(number), "label": pantograph or None}
            axes.hist(x, bins, **bars)
            for probability, look in ((0.5, "-"), (adverse_probability(name), "--")):
                axes.axvline(float(np.quantile(x, probability)), color=colour, ls=look, lw=1.2)
        _panel(axes, _meaning(name), "runs")
        axes.yaxis.set_major_locator(MaxNLocator(5, integer=True))
    if len(table.of(statistics[0])) > 1:
        figures.legend_above(panels[0])
    panels[0].set_title(f"solid: median, dashed: {_ADVERSE}", loc="left", fontsize="medium")
    return figure


def _panel(axes: Axes, x: str, y: str, title: str = "") -> None:
    figures.tidy(axes, x, y, title)
    axes.set_ylabel(figures.wrapped(y), fontsize="small")
    axes.xaxis.label.set_fontsize("small")


def _beside(label: str, n: int) -> str:
    """One of ``n`` labels side by side."""
    return figures.wrapped(label, min(_WIDTH_OF_LABEL, _WIDTH_OF_ALL // n))


def _meaning(name: str) -> str:
    known = STATISTICS.get(name)
    return known.meaning if known is not None and known.meaning else name


RECORD = "uncertainty.json"
PICTURES = {
    "uncertainty_scatter.png": scatter,
    "uncertainty_parallel.png": parallel_coordinates,
    "uncertainty_convergence.png": convergence,
    "uncertainty_histogram.png": histograms,
}
_MOST_REMARKS = 5  # on a terminal; all are in the file
_WHAT_FAILS = ("Share of the runs in which", "Probability that")  # by whether these are samples


def files_of(
    table: RunTable, found: Uncertainty, plotted: Sequence[str] = ()
) -> dict[str, Content]:
    """An evaluation of a table, its pictures and the sampling. Not collective.

    ``plotted`` are statistics that are drawn; the usual ones if there are none.
    """
    content: dict[str, Content] = {RECORD: vars(found)}
    if table.sampling is not None:
        content |= sampling_file(table.sampling)
    for name, draw in PICTURES.items():
        content[name] = partial(draw, table, plotted)
    return content


def write_evaluated(
    out: Path, rows: Sequence[Row], sampling: SamplingTable, plotted: Sequence[str] = ()
) -> tuple[Uncertainty, list[Path]]:
    """Evaluate rows of a sweep of samples, and write ``files_of`` that. Not collective."""
    table = run_table(rows, sampling)
    found = evaluate(table)
    return found, write_files(out, files_of(table, found, plotted))


def as_text(found: Uncertainty) -> str:
    """Tables for a terminal: statistics with quantiles, probabilities, indices, notes."""
    parts = []
    if found.statistics:
        parts.append(_statistics(found).text())
    if found.probabilities:
        parts.append(
            f"{_WHAT_FAILS[found.is_sampled]} a criterion fails, with 95 % bounds "
            f"(Clopper-Pearson)\n{_probabilities(found).text()}"
        )
    # Of columns that people read.
    hidden = [name for name, column in STATISTICS.items() if not column.head]
    shown = [r for r in found.sensitivity if "with" not in r and r["statistic"] not in hidden]
    if shown:
        parts.append(capital(found.method) + "\n" + _indices(shown).text())
    n_of = {one["remark"]: one["n"] for one in found.remarks}
    lines = []
    for texts in alike(n_of)[:_MOST_REMARKS]:
        numbers = ", with different numbers, such as" if len(texts) > 1 else ""
        n = sum(n_of[text] for text in texts)
        lines.append(f"REMARK      {n} of {found.n_runs} runs{numbers}: {texts[0]}")
    lines += [f"NOTE        {note}" for note in found.notes]
    return "\n\n".join([*parts, *(["\n".join(lines)] if lines else [])])


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
        Column("low_bounds", "95 %", ">"),
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
            "low_bounds": _bounds(low, "value"),
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
        Column("probability", "probability" if found.is_sampled else "share", ".4g"),
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
    # None where a value is no number.
    rows = [{n: None if value != value else value for n, value in row.items()} for row in shown]
    return StudyTable(columns, rows)


def _bounds(row: Row, name: str) -> str:
    """Bounds of an estimate; a dash stands for one that too few samples leave open."""
    low, high = (row[f"{name}_{end}"] for end in ("low", "high"))
    return " to ".join("-" if one != one else f"{one:.4g}" for one in (low, high))
