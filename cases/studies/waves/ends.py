"""What the ends of a scene's line send back over frequency: curves, rows and a picture."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from catenary.base.errors import InputError
from catenary.cases.studies.waves.theory import HIGHEST, row_of
from catenary.postproc.report.pictures import figures
from catenary.solver.ends.line_beyond import SIDES
from catenary.solver.problem.ends import AbsorbingLayer, EndCondition, Periodic
from catenary.solver.statics.line_at_rest import LineAtRest
from catenary.solver.waves.end_reflection import EndReflection, end_reflection

# Frequencies, and the least reflection that is drawn.
_FIRST, _STEP, _LEAST = 0.5, 0.05, 1e-5
# Of a layer, whose reflection changes within a tenth of a hertz beside the gaps between bands.
_STEP_OF_LAYER = 0.02
# Share of the energy that a line in the picture stands for.
_LITTLE = 0.02


def reflections_of(rest: LineAtRest) -> list[EndReflection]:
    """What both ends send back, start first, with the line's own damping from where they begin.

    None if the line's spans there are not alike. Not collective.
    """
    found = []
    for side, end in enumerate(rest.problem.ends):
        step = _STEP_OF_LAYER if isinstance(end, AbsorbingLayer) else _STEP
        frequency = np.arange(_FIRST, HIGHEST + 0.5 * step, step)
        try:
            found.append(end_reflection(rest.model, side, frequency, own_damping=True))
        except InputError:
            return []
    return found


def reflection_rows(found: list[EndReflection], speed: float) -> list[dict[str, Any]]:
    """Figures of waves that outrun a train [m/s]."""
    rows = []
    for side, end in zip(SIDES, found, strict=False):
        of_what = f"the {side} of the line sends back of waves that outrun the train"
        amplitude, energy = end.of_faster(speed), end.energy_of_faster(speed)
        rows += [
            row_of(f"{name}_{side}", value, "-", f"{what} that {of_what}")
            for name, value, what in (
                ("largest_reflection", amplitude[0], "largest amplitude"),
                ("rms_reflection", amplitude[1], "root mean square amplitude"),
                ("largest_energy", energy[0], "largest share of the energy"),
                ("mean_energy", energy[1], "mean share of the energy"),
            )
        ]
    return rows


def curve_rows(found: list[EndReflection]) -> list[dict[str, Any]]:
    """Every wave that comes to an end, with what comes back."""
    return [
        {"end": side, "frequency_Hz": float(f), "group_velocity_m_per_s": float(v), "reflected": r}
        for side, end in zip(SIDES, found, strict=False)
        for f, speeds, shares in zip(end.frequency, end.group_velocity, end.reflected, strict=True)
        for v, r in zip(speeds.tolist(), shares.tolist(), strict=True)
        if np.isfinite(v)
    ]


@figures.own_style()
def picture(
    found: list[EndReflection], ends: tuple[EndCondition, EndCondition], speed: float
) -> Figure:
    """Reflection over frequency, waves that outrun the train filled."""
    figure = figures.new_figure(4.2)
    axes = figure.add_subplot()
    for number, (side, end, kind) in enumerate(zip(SIDES, found, ends, strict=False)):
        frequency = np.broadcast_to(end.frequency[:, None], end.reflected.shape)
        there = np.isfinite(end.reflected)
        fast = there & (end.group_velocity > speed)
        shown = np.maximum(end.reflected, _LEAST)
        # The start is drawn larger, to be seen beneath an end that sends back as much.
        colour, marker, size = figures.COLOURS[number], "os"[number], (26.0, 6.0)[number]
        name = f"{side}, {_name(kind)}"
        slow = there & ~fast
        axes.scatter(
            frequency[slow], shown[slow], s=size, marker=marker, facecolors="none",
            edgecolors=colour, linewidths=0.5, alpha=0.6,
        )  # fmt: skip
        axes.scatter(
            frequency[fast], shown[fast], s=size, marker=marker, color=colour, linewidths=0,
            label=f"{name}: waves that outrun the train",
        )  # fmt: skip
    axes.scatter(
        [], [], s=8.0, facecolors="none", edgecolors=figures.GREY, linewidths=0.5,
        label="slower waves",
    )  # fmt: skip
    axes.axhline(_LITTLE**0.5, color=figures.GREY, linewidth=0.8, linestyle="--", zorder=0)
    axes.annotate(
        f"{100.0 * _LITTLE:g} % of the energy", (HIGHEST, _LITTLE**0.5), (-3.0, 2.0),
        textcoords="offset points", ha="right", va="bottom", fontsize="small", color=figures.GREY,
    )  # fmt: skip
    axes.set_yscale("log")
    axes.set_xlim(0.0, HIGHEST)
    axes.set_ylim(0.7 * _LEAST, 2.0)
    figures.tidy(axes, "frequency [Hz]", f"amplitude sent back [-] (least drawn: {_LEAST:g})")
    figures.legend_above(axes, 2)
    return figure


def _name(end: EndCondition) -> str:
    if isinstance(end, AbsorbingLayer):
        return f"layer of {end.n_spans} spans"
    return "periodic" if isinstance(end, Periodic) else "fixed"
