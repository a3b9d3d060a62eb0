"""The stability map as a picture."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from catenary.cases.scene.run.numerics import MAX_DT
from catenary.cases.studies.stability.map import Limit, StabilityMap, meets
from catenary.postproc.report.pictures import figures

_MARKERS = {"explicit": "o", "iterated": "s", "fixed_point": "^"}
_RAISED = str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")
_STABLE, _ONLY_IMPLICIT = "#eef3e6", "#fbeee6"


@figures.own_style()
def draw(found: StabilityMap) -> Figure:
    """Largest step over contact stiffness and over head mass, both logarithmic."""
    figure = figures.new_figure(5.6)
    left, right = figure.subplots(1, 2, sharey=True)
    by_mass = {
        f"head {mass:g} kg": _series(found, "stiffness", head_mass=mass)
        for mass in found.grid.few_masses
    }
    by_stiffness = {
        f"contact {_power(k)} N/m": _series(found, "head_mass", stiffness=k)
        for k in found.grid.few_stiffnesses
    }
    _panel(left, by_mass, "stiffness")
    _panel(right, by_stiffness, "head_mass", named=True)
    figures.tidy(left, "contact stiffness [N/m]", "largest stable step [ms]")
    figures.tidy(right, "head mass [kg]", "")
    stiffness, mass, dt = found.own
    if stiffness is not None:
        left.plot(stiffness, 1e3 * dt, "*", ms=11, color="black", zorder=5)
        left.annotate(
            f"the case: {mass:g} kg",
            (stiffness, 1e3 * dt),
            textcoords="offset points",
            xytext=(0, -15),
            ha="center",
            fontsize="small",
        )
    implicit = found.of("implicit")
    everywhere = all(one.marched == np.inf and one.theory == np.inf for one in implicit)
    word = "implicit: stable everywhere on this map" if everywhere else "implicit: see the table"
    right.text(0.97, 0.97, word, transform=right.transAxes, ha="right", va="top", fontsize="small")
    left.legend(
        handles=[
            Line2D([], [], color=figures.colour(i), label=name) for i, name in enumerate(by_mass)
        ],
        loc="upper right",
        fontsize="small",
        frameon=False,
    )
    word = "a coupling is stable below its line;\nabove both lines only the implicit one is"
    left.text(0.03, 0.03, word, transform=left.transAxes, va="bottom", fontsize="small")
    figure.suptitle(
        f"{found.case}: stability of the couplings while contact lasts and droppers are taut (the "
        f"linear system);\n{meets(found)} {found.wire_mass:.2g} kg",
        x=0.01,
        ha="left",
        fontsize="medium",
    )
    figure.legend(handles=_key(), loc="outside lower center", ncols=3, fontsize="small",
                  frameon=False)  # fmt: skip
    return figure


def _series(found: StabilityMap, along: str, **fixed: float) -> dict[str, list[Limit]]:
    """Limits of each coupling that has any, in the order of what varies."""
    return {
        name: sorted(found.of(name, **fixed), key=lambda one: float(getattr(one, along)))
        for name in _MARKERS
    }


def _panel(
    axes: Axes, curves: dict[str, dict[str, list[Limit]]], along: str, named: bool = False
) -> None:
    """Curves of one panel and the regions below and above the lowest; ``named`` at their ends."""
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.yaxis.set_major_formatter("{x:g}")
    lowest: tuple[np.ndarray, np.ndarray] | None = None
    for number, (label, series) in enumerate(curves.items()):
        colour = figures.colour(number)
        for name, limits in series.items():
            x = np.array([getattr(one, along) for one in limits])
            theory = 1e3 * np.array([one.theory for one in limits])
            marched = 1e3 * np.array([one.marched for one in limits])
            there = np.isfinite(marched)
            axes.plot(x[there], marched[there], _MARKERS[name], color=colour, ms=5, mfc="none")
            if name == "fixed_point":  # the line of iterated
                continue
            axes.plot(x, theory, "-" if name == "explicit" else "--", color=colour, linewidth=1.2)
            if name == "explicit" and named:
                end = int(np.argmax(x))
                axes.annotate(
                    label,
                    (x[end], theory[end]),
                    textcoords="offset points",
                    xytext=(-4, -13),
                    ha="right",
                    fontsize="small",
                    color=colour,
                )
            if name == "explicit" and (lowest is None or theory[0] < lowest[1][0]):
                lowest = x, theory
    top = 1.25e3 * MAX_DT
    axes.set_ylim(None, top)
    if lowest is not None:
        bottom = axes.get_ylim()[0]
        axes.fill_between(lowest[0], bottom, lowest[1], color=_STABLE, linewidth=0, zorder=0)
        axes.fill_between(lowest[0], lowest[1], top, color=_ONLY_IMPLICIT, linewidth=0, zorder=0)
        axes.set_ylim(bottom, top)


def _key() -> list[Line2D]:
    lines = (("-", "explicit, theory (ω dt = 2)"), ("--", "exchanges, theory"))
    grey = figures.GREY
    keys = [Line2D([], [], color=grey, lw=1.2, ls=style, label=name) for style, name in lines]
    for name, marker in _MARKERS.items():
        told = f"{name}, marched"
        keys.append(Line2D([], [], color=grey, ls="", marker=marker, mfc="none", label=told))
    return keys


def _power(value: float) -> str:
    """A number as a power of ten, without marks of mathematics, which pictures do not read."""
    exponent = int(np.floor(np.log10(value)))
    lead = value / 10**exponent
    front = "" if np.isclose(lead, 1.0) else f"{lead:.2g} · "
    return f"{front}10{str(exponent).translate(_RAISED)}"
