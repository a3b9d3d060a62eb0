"""Histograms of the contact forces of a sweep: a row for each pantograph, and their spread."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure

from catenary.cases.studies.sweep.jobs import Ended
from catenary.postproc.evaluate.statistics import HISTOGRAM_BIN
from catenary.postproc.files.csv_text import csv_text
from catenary.postproc.report.pictures import figures
from catenary.postproc.report.study_table import Content

TABLE, PICTURE = "force_histogram.csv", "force_histogram.png"
_LOW, _HIGH = 0.05, 0.95


class ForceHistograms(NamedTuple):
    """Histograms of the filtered contact force over bins that all rows share.

    Attributes
    ----------
    variants, pantographs : (n_rows,) names
    edges : (n_bins + 1,) of the bins [N]
    percent : (n_rows, n_bins) share of time in each bin [%]
    """

    variants: Sequence[str]
    pantographs: Sequence[str]
    edges: np.ndarray
    percent: np.ndarray


def force_histograms(ended: Sequence[Ended]) -> ForceHistograms | None:
    """The histograms of all variants that have some; None if there are none.

    Pantographs without statistics have none. Left out too are those whose force spans so much,
    above 10 kN, that their bins are wider than others.
    """
    known = [
        (one.variant.name, own["name"], own)
        for one in ended
        for own in one.summary.get("histograms", [])
        if own["bin_N"] == HISTOGRAM_BIN
    ]
    if not known:
        return None
    variants, pantographs, own = zip(*known, strict=True)
    starts = [round(one["from_N"] / HISTOGRAM_BIN) for one in own]
    first = min(starts)
    n_bins = (
        max(start + len(one["percent"]) for start, one in zip(starts, own, strict=True)) - first
    )
    percent = np.zeros((len(own), n_bins))
    for row, start, one in zip(percent, starts, own, strict=True):
        row[start - first :][: len(one["percent"])] = one["percent"]
    edges = HISTOGRAM_BIN * (first + np.arange(n_bins + 1))
    return ForceHistograms(variants, pantographs, edges, percent)


def files(ended: Sequence[Ended]) -> dict[str, Content]:
    """Table and picture of the histograms of a sweep, nothing if there are none."""
    found = force_histograms(ended)
    if found is None:
        return {}
    heads = ["variant", "pantograph", *(f"from_{edge:g}_N" for edge in found.edges[:-1])]
    names = zip(found.variants, found.pantographs, strict=True)
    rows: Any = ([*own, *row.tolist()] for own, row in zip(names, found.percent, strict=True))
    return {TABLE: csv_text(heads, rows), PICTURE: lambda: draw(found)}


@figures.own_style()
def draw(found: ForceHistograms) -> Figure:
    """The mean share of time in each bin, and between which shares 90 % of the variants lie."""
    figure = figures.new_figure(3.4)
    axes = figure.subplots()
    names = np.array(found.pantographs)
    for number, name in enumerate(dict.fromkeys(found.pantographs)):
        own, colour = found.percent[names == name], figures.colour(number)
        low, high = np.quantile(own, (_LOW, _HIGH), axis=0)
        axes.stairs(high, found.edges, baseline=low, fill=True, color=colour, alpha=0.25)
        axes.stairs(own.mean(axis=0), found.edges, color=colour, label=name)
    figures.tidy(axes, "filtered contact force, 0-20 Hz [N]", "share of time [%]")
    axes.set_title("line: mean of all variants, band: 5 to 95 % of them", loc="left")
    figures.legend_above(axes)
    return figure
