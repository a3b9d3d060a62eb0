"""The train under its pantographs, as boxes: what gives a picture its size."""

from __future__ import annotations

import numpy as np

# Length of a coach and of the gap to the next one, how far the first one reaches ahead of the
# first pantograph; half its width, and the height of its floor [m].
COACH, GAP, AHEAD = 25.0, 0.6, 8.0
HALF_WIDTH, FLOOR = 1.45, 1.0
# Corners of the faces of a box.
FACES = np.array(
    [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]]
)


def coaches(position: np.ndarray) -> np.ndarray:
    """From and to of the coaches along the track, (n, 2) [m], as many as carry the pantographs.

    Parameters
    ----------
    position : of the pantographs [m]
    """
    front = float(position.max()) + AHEAD
    n = 1 + int((front - float(position.min())) // (COACH + GAP))
    begin = front - (COACH + GAP) * np.arange(n)
    return np.column_stack([begin - COACH, begin])


def boxes(position: np.ndarray, roof: float) -> np.ndarray:
    """Corners of the coaches under a roof (8 n, 3) [m]."""
    corners = [
        [x, side * HALF_WIDTH, z]
        for begin, end in coaches(position)
        for z in (FLOOR, roof)
        for side in (-1.0, 1.0)
        for x in (begin, end)
    ]
    return np.array(corners)
