"""Pictures of an identification: the passage beside its marches, and parameters with widths."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from catenary.cases.studies.identification.measurement import UNITS
from catenary.cases.studies.identification.study import Identification
from catenary.postproc.report.pictures import figures

# Samples more than these are drawn small.
_MANY = 400
# Entries of the panel of parameters that leave letters legible.
_MOST = 60


@figures.own_style()
def draw_passage(found: Identification) -> Figure:
    """The samples of each signal over its marches, by the priors' means and as found; below them
    the residual beside the standard deviation of the stated noise."""
    n = len(found.signals)
    figure = figures.new_figure(4.2 * n)
    panels = figure.subplots(2 * n, 1, sharex=True, height_ratios=[2.2, 1.0] * n)
    size = 4.5 if found.place.size <= _MANY else 2.0
    for number, (signal, bias) in enumerate(zip(found.signals, found.biases, strict=True)):
        above, below = panels[2 * number : 2 * number + 2]
        modelled, unit = found.modelled[number] + bias, UNITS[signal.name]
        figures.curve(above, found.place, signal.values, 2, "measured", ".", ms=size, zorder=3)
        place, by_priors = found.by_priors[number]
        figures.curve(above, place, by_priors, 1, "priors' means", "--", 1.0)
        place, marched = found.marched[number]
        figures.curve(above, place, marched + bias, 0, "found", width=1.0)
        figures.tidy(above, "", f"{signal.name} [{unit}]")
        figures.legend_above(above)
        factor, unit = (1e3, "mm") if unit == "m" else (1.0, unit)
        noise = factor * signal.deviation
        below.axhspan(-noise, noise, color=figures.SHADE, zorder=0)
        figures.curve(
            below, found.place, factor * (signal.values - modelled), 2, None, ".", ms=size
        )
        below.axhline(0.0, color=figures.GREY, linewidth=0.8, zorder=1)
        figures.tidy(below, "", f"residual [{unit}]\n(shaded: noise)")
    panels[-1].set_xlabel("position along the track [m]")
    return figure


@figures.own_style()
def draw_parameters(found: Identification) -> Figure:
    """Found values less the priors' means with their posterior deviations, in deviations of the
    priors, beside these. Of many parameters those that moved most."""
    deviations = np.array([one.deviation for one in found.unknowns])
    moved = (found.values - [one.mean for one in found.unknowns]) / deviations
    widths = found.posterior.widths
    shown = np.sort(np.argsort(-np.abs(moved), kind="stable")[:_MOST])
    figure = figures.new_figure(1.2 + 0.22 * len(shown))
    axes = figure.subplots()
    rows = np.arange(len(shown))
    axes.axvspan(-1.0, 1.0, color=figures.SHADE, zorder=0, label="prior")
    axes.errorbar(
        moved[shown], rows, xerr=widths[shown], fmt="o", ms=3.5, color=figures.colour(0),
        elinewidth=1.2, capsize=2.5, label="found",
    )  # fmt: skip
    figures.tidy(axes, "distance from the prior's mean [deviations of the prior]", "")
    axes.set_yticks(rows, [found.unknowns[k].name for k in shown], fontsize="small")
    axes.set_ylim(len(shown) - 0.5, -0.5)
    figures.legend_above(axes)
    return figure
