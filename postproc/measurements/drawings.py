"""Pictures of a measured passage beside a run."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.figure import Figure

from catenary.postproc.measurements.comparison import Overlay, UpliftAtSupports
from catenary.postproc.report.pictures.envelope import thinned
from catenary.postproc.report.pictures.figures import (
    curve,
    legend_above,
    own_style,
    stacked,
    tidy,
)

PLACE = "position along the track [m]"


@own_style()
def forces(overlays: Sequence[Overlay]) -> Figure | None:
    """Measured forces and those of the run along the track, a panel for each pantograph."""
    n = len(overlays)
    if not n:
        return None
    figure, panels = stacked(0.7 + 2.7 * n, n, shared=True)
    for axes, own in zip(panels, overlays, strict=True):
        for number, (values, label) in enumerate(((own.run, "run"), (own.measured, "measured"))):
            chosen = thinned(values)
            curve(axes, own.place[chosen], values[chosen], number, label)
        tidy(axes, "", "contact force [N]", own.pantograph.capitalize())
        legend_above(axes)
    panels[-1].set_xlabel(PLACE)
    return figure


@own_style()
def uplifts(own: UpliftAtSupports | None) -> Figure | None:
    """Largest uplifts at supports, measured and of the run; None if they were not measured."""
    if own is None:
        return None
    figure, (axes,) = stacked(3.0, 1)
    for number, (values, label) in enumerate(((own.run, "run"), (own.measured, "measured"))):
        curve(axes, own.place, 1e3 * values, number, label, "o")
    tidy(axes, PLACE, "largest uplift [mm]")
    legend_above(axes)
    return figure
