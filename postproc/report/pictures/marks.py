"""Marks that pictures along the track share: supports, droppers, the evaluation stretch."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection

from catenary.postproc.read.results import Results
from catenary.postproc.report.pictures.figures import COLOURS, GREY, LIGHT, SHADE

# More supports or droppers than these are no marks but a grey ground: they are left out.
_MOST_SUPPORTS, _MOST_DROPPERS = 200, 1000


def mark_line(axes: Axes, results: Results, start: float, end: float) -> None:
    """Supports as lines, droppers as ticks at the bottom, the evaluation stretch shaded."""
    low, high = results.evaluation
    axes.axvspan(low, high, color=SHADE, zorder=0, label="evaluation stretch")
    support = results.line("support_x")
    support = support[(support >= start) & (support <= end)]
    _uprights(axes, support, 0.9)
    dropper = results.line("dropper_x")
    dropper = dropper[(dropper >= start) & (dropper <= end)]
    if dropper.size <= _MOST_DROPPERS:
        axes.plot(
            dropper,
            np.full(dropper.size, 0.015),
            "|",
            color=GREY,
            markersize=5,
            markeredgewidth=0.7,
            transform=axes.get_xaxis_transform(),
            label="dropper",
            clip_on=True,
        )
    axes.set_xlim(start, end)


def still_marks(axes: Axes, x: np.ndarray, low: np.ndarray, high: np.ndarray) -> None:
    """Dashes where ranges are too small for a line that would be seen."""
    still = high - low < 0.01 * (np.nanmax(high, initial=0.0) - np.nanmin(low, initial=0.0))
    axes.plot(x[still], high[still], "_", color=COLOURS[0], ms=3.0)


def mark_static(axes: Axes, results: Results, start: float, end: float) -> None:
    """Supports and droppers of a stretch of the line at rest, with a margin at both ends."""
    support = results.line("support_x")
    _uprights(axes, support[(support >= start - 1e-6) & (support <= end + 1e-6)], 1.2)
    dropper = results.line("dropper_x")
    dropper = dropper[(dropper >= start) & (dropper <= end)]
    axes.plot(
        dropper,
        np.full(dropper.size, 0.02),
        "|",
        color=GREY,
        markersize=7,
        transform=axes.get_xaxis_transform(),
        label="dropper",
    )
    axes.set_xlim(*with_margin(np.array([start, end])))


def _uprights(axes: Axes, support: np.ndarray, width: float) -> None:
    """Supports as lines over the whole height, in one collection."""
    if not 0 < support.size <= _MOST_SUPPORTS:
        return
    lines = [((x, 0.0), (x, 1.0)) for x in support]
    transform = axes.get_xaxis_transform()
    known: dict[str, Any] = {"colors": LIGHT, "linewidths": width, "zorder": 1, "label": "support"}
    axes.add_collection(LineCollection(lines, transform=transform, **known), autolim=False)


def travelled(results: Results) -> tuple[float, float]:
    """From and to of the stretch on which a pantograph was [m]."""
    low, high = results.extremes("contact_position")
    return float(low.min()), float(high.max())


def with_margin(x: np.ndarray) -> tuple[float, float]:
    """Limits of an axis on which places ``x`` stand off its ends [m]."""
    if not x.size:
        return 0.0, 1.0
    margin = 0.015 * max(float(np.ptp(x)), 1.0)
    return float(x.min()) - margin, float(x.max()) + margin
