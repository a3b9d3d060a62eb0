"""Panels to draw on that were made before, for pictures that nobody looks at.

To make a panel takes longer than to draw on it.
"""

from __future__ import annotations

import functools

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure


@functools.cache
def blank(n: int) -> tuple[Figure, list[Axes]]:
    """A figure with ``n`` panels, the same whenever it is asked for."""
    figure = Figure()
    FigureCanvasAgg(figure)
    return figure, list(figure.subplots(n, 1, squeeze=False)[:, 0])


def stacked(height: float, n: int, *, shared: bool = False) -> tuple[Figure, list[Axes]]:
    """In place of the report's."""
    assert height > 0.0
    return blank(n)


def nothing(*words: object, **named: object) -> None:
    """In place of what makes labels, grids and legends."""
