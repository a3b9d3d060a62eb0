"""Pictures of a measured passage beside a run."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.figure import Figure

from catenary.postproc.measurements.comparison import Overlay, UpliftAtSupports
from catenary.postproc.report.pictures import figures
from catenary.postproc.report.pictures.envelope import thinned

_PLACE = "position along the track [m]"


@figures.own_style()
def forces(overlays: Sequence[Overlay]) -> Figure | None:
    """Measured forces and those of the run along the track, a panel for each pantograph."""
    if not overlays:
        return None
    n = len(overlays)
    figure, panels = figures.stacked(0.7 + 2.7 * n, n, shared=True)
    for axes, own in zip(panels, overlays, strict=True):
        for number, (values, label) in enumerate(((own.run, "run"), (own.measured, "measured"))):
            chosen = thinned(values)
            figures.curve(axes, own.place[chosen], values[chosen], number, label)
        figures.tidy(axes, "", "contact force [N]", own.pantograph.capitalize())
        figures.legend_above(axes)
    panels[-1].set_xlabel(_PLACE)
    return figure


@figures.own_style()
def uplifts(own: UpliftAtSupports | None) -> Figure | None:
    """Largest uplifts at supports, measured and of the run; None if they were not measured."""
    if own is None:
        return None
    figure, (axes,) = figures.stacked(3.0, 1)
    for number, (values, label) in enumerate(((own.run, "run"), (own.measured, "measured"))):
        figures.curve(axes, own.place, 1e3 * values, number, label, "o")
    figures.tidy(axes, _PLACE, "largest uplift [mm]")
    figures.legend_above(axes)
    return figure
