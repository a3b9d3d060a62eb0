"""Picture of a line over temperatures: tension along its wires, and how far their ends move."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import matplotlib
import numpy as np

from catenary.postproc.report.pictures.figures import (
    COLOURS,
    GREY,
    LIMIT,
    new_figure,
    own_style,
    tidy,
)
from catenary.solver.statics.tension_along import LineAtTemperature

# Change of tension that is allowed [%].
_ALLOWED = 10.0


@own_style()
def draw_temperatures(rests: Sequence[LineAtTemperature], path: Path) -> None:
    """Write the picture as PNG or SVG, by the file's suffix. Not collective."""
    found = [rest for rest in rests if not rest.why_not]
    names = [wire.name for wire in found[0].wires if wire.ends] if found else []
    figure = new_figure(2.6 * (len(names) + 1))
    panels = figure.subplots(len(names) + 1, 1, squeeze=False)[:, 0]
    warmth = matplotlib.colormaps["coolwarm"]
    range_ = [rest.warmer for rest in found]
    low, high = min(range_, default=0.0), max(range_, default=1.0)
    for axes, name in zip(panels, names, strict=False):
        for rest in found:
            wire = next(own for own in rest.wires if own.name == name)
            share = (rest.warmer - low) / max(high - low, 1e-12)
            label = f"{rest.warmer:+g} K"
            axes.plot(wire.x, 100 * wire.change, color=warmth(share), lw=1.3, label=label)
        worst = max((np.abs(axes.get_ylim()).max(), 1.0))
        if worst > 0.7 * _ALLOWED:
            for side in (-_ALLOWED, _ALLOWED):
                axes.axhline(side, color=LIMIT, lw=0.9, ls="--")
        tidy(axes, "position along the track [m]", "change of tension [%]", name)
        if name == names[0]:
            axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False, fontsize=8)
    ends = panels[-1]
    for colour, name in zip(COLOURS, names, strict=False):
        wires = [own for rest in found for own in rest.wires if own.name == name]
        for i, end in enumerate(wires[0].ends):
            moved = [1e3 * own.moved[i] for own in wires]
            style = "-" if end.outwards > 0 else "--"
            label = f"{name}, {'end' if end.outwards > 0 else 'start'}"
            ends.plot(range_, moved, style, color=colour, marker="o", ms=3, lw=1.3, label=label)
    ends.axhline(0.0, color=GREY, lw=0.6)
    tidy(ends, "temperature above the installation [K]", "end outwards [mm]", "ends of the wires")
    if names:
        ends.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False, fontsize=8)
    figure.savefig(path)
