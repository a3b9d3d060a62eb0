"""Histograms of the contact forces of a sweep: a row for each pantograph, and their spread."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from catenary.cases.studies.sweep.jobs import Ended
from catenary.postproc.evaluate.statistics import HISTOGRAM_BIN
from catenary.postproc.report.pictures import figures
from catenary.postproc.report.study_table import Content, file_table

TABLE, PICTURE = "force_histogram.csv", "force_histogram.png"
_LOW, _HIGH = 0.05, 0.95


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


def files(ended: Sequence[Ended]) -> dict[str, Content]:
    """Table and picture of the histograms of a sweep, nothing if there are none."""
    found = force_histograms(ended)
    if found is None:
        return {}
    heads = [*found.index.names, *(f"from_{edge:g}_N" for edge in found.columns)]
    rows = ([*own, *row] for own, row in zip(found.index, found.to_numpy().tolist(), strict=True))
    return {TABLE: file_table(heads, rows), PICTURE: lambda: draw(found)}


@figures.own_style()
def draw(found: pd.DataFrame) -> Figure:
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
