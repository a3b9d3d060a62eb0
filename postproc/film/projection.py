"""How points of a line become points of a picture, by where the line is looked at from.

Pictures lie in VTK's plane of x and z, and y is the layer: what has a smaller one is in front.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from catenary.postproc.film.scale import Scale
from catenary.postproc.film.view import View


@dataclass(frozen=True)
class Projection:
    """A view with its scale."""

    view: View
    scale: Scale

    def seen(self, rest: np.ndarray, moved: np.ndarray | float, layer: float) -> np.ndarray:
        """Points of the picture, (n, 3), of points at rest that have moved.

        Lengths along the track, and motions along it, are drawn as they are.

        Parameters
        ----------
        rest, moved : (n, 3) along the track, to the left and upward [m]
        layer : of the picture
        """
        moved = np.broadcast_to(moved, rest.shape)
        aside, up = (self.scale.drawn(rest[:, axis], moved[:, axis]) for axis in (1, 2))
        along = rest[:, 0] + moved[:, 0]
        across, high = {
            View.SIDE: (along, up),
            View.PLAN: (along, aside),
            View.ALONG: (-aside, up),
        }[self.view]
        return np.column_stack([across, np.full(len(rest), layer), high])
