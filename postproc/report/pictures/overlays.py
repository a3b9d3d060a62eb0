"""Pictures of passages over each other: of two runs, or of a run and what was measured."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from catenary.postproc.report.pictures import figures
from catenary.postproc.report.pictures.envelope import thinned

_PLACE = "position along the track [m]"
# Label, places along the track (n,) [m], and values (n,) there.
Curve = tuple[str, np.ndarray, np.ndarray]
# Marks of a panel: those of equal values let each other be seen.
_MARKS = ("o", "x", "^", "s")


@figures.own_style()
def forces(
    panels: Sequence[tuple[str, Sequence[Curve]]],
    evaluated: tuple[float, float] | None = None,
    below: str = "",
) -> Figure | None:
    """Contact forces along the track, a panel for each pantograph; None without pantographs.

    Parameters
    ----------
    panels : sequence of tuple
        Name of each pantograph, and its curves of forces [N].
    evaluated : tuple of float, optional
        From and to of the evaluation stretch, which is shaded [m].
    below : str, optional
        Cut-off of forces that are filtered, with its unit.
    """
    if not panels:
        return None
    n = len(panels)
    figure, axes = figures.stacked(0.7 + 2.3 * n, n, shared=True)
    for own, (name, curves) in zip(axes, panels, strict=True):
        for number, (label, place, force) in enumerate(curves):
            chosen = thinned(force)
            look = figures.line(number)
            figures.curve(own, place[chosen], force[chosen], number, label, look)
        _shade(own, evaluated)
        force_of = f"contact force, {below} [N]" if below else "contact force [N]"
        figures.tidy(own, "", force_of, name.capitalize())
        figures.legend_above(own)
    axes[-1].set_xlabel(_PLACE)
    return figure


@figures.own_style()
def uplifts(curves: Sequence[Curve], evaluated: tuple[float, float] | None = None) -> Figure | None:
    """Largest uplifts at supports, as marks; None without any.

    Parameters
    ----------
    curves : sequence of Curve
        Curves of uplifts, positive upward [m].
    evaluated : tuple of float, optional
        From and to of the evaluation stretch, which is shaded [m].
    """
    if not curves:
        return None
    figure, (axes,) = figures.stacked(3.2, 1)
    for number, (label, place, uplift) in enumerate(curves):
        look = _MARKS[number % len(_MARKS)]
        figures.curve(axes, place, 1e3 * uplift, number, label, look)
    _shade(axes, evaluated)
    figures.tidy(axes, _PLACE, "largest uplift [mm]")
    figures.legend_above(axes)
    return figure


def _shade(axes: Axes, evaluated: tuple[float, float] | None) -> None:
    if evaluated is not None:
        axes.axvspan(*evaluated, color=figures.SHADE, zorder=0, label="evaluation stretch")
