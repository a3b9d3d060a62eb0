"""What the ends of a scene's line send back over frequency: curves, rows and a picture."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from catenary.cases.studies.waves.theory import HIGHEST
from catenary.postproc.report.pictures import figures
from catenary.solver.base.errors import InputError
from catenary.solver.ends.line_beyond import SIDES
from catenary.solver.problem.ends import AbsorbingLayer, EndCondition, Periodic
from catenary.solver.statics.line_at_rest import LineAtRest
from catenary.solver.waves.end_reflection import EndReflection, end_reflection

# Frequencies, and the least reflection that is drawn.
_FIRST, _STEP, _LEAST = 0.5, 0.05, 1e-5


def reflections_of(rest: LineAtRest) -> list[EndReflection]:
    """What both ends send back, start first; none if the line's spans there are not alike. Not
    collective."""
    frequency = np.arange(_FIRST, HIGHEST + 0.5 * _STEP, _STEP)
    try:
        return [end_reflection(rest.model, side, frequency) for side in range(len(SIDES))]
    except InputError:
        return []


def reflection_rows(found: list[EndReflection], speed: float) -> list[dict[str, Any]]:
    """Figures of waves that outrun a train [m/s]."""
    rows = []
    for side, end in zip(SIDES, found, strict=False):
        for name, value in zip(("largest", "rms"), end.of_faster(speed), strict=True):
            meaning = f"{name} reflection of the {side} of the line, of waves that outrun the train"
            rows.append(
                {"name": f"{name}_reflection_{side}", "value": value, "unit": "-"}
                | {"meaning": meaning}
            )
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
