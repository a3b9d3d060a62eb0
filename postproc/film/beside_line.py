"""What films and ParaView show beside the line: the train as boxes, the contacts, the rails."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from catenary.postproc.film.film_data import FilmData

# Half the distance of the rails [m].
HALF_GAUGE = 0.75
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


def faces_of(n_coaches: int) -> np.ndarray:
    """Corners of the faces of all coaches, (6 n, 4)."""
    return np.concatenate([8 * k + FACES for k in range(n_coaches)])


def contacts(
    data: FilmData, row: int, aside: Callable[[str, float], float]
) -> tuple[np.ndarray, np.ndarray]:
    """Where the wires above the heads rest, and how far the heads, and sideways the wires, have
    moved from there in a record, (p, 3) each [m].

    Parameters
    ----------
    aside : how far a wire has moved to the left, by its name and the place along the track [m]
    """
    rest, now = np.zeros((2, data.n_pantographs, 3))
    rest[:, 0] = data.position[row]
    rest[:, 2] = data.rest_height(data.position[row])
    now[:, 2] = data.head_height[row] - rest[:, 2]
    for p, x in enumerate(data.position[row].tolist()):
        wire = data.touched(x)
        at = data.points[data.wires[wire]]
        rest[p, 1], now[p, 1] = np.interp(x, at[:, 0], at[:, 1]), aside(wire, x)
    return rest, now


def rails(data: FilmData) -> tuple[np.ndarray, np.ndarray]:
    """Points (4, 3) [m] and lines (2, 2) of the rails, from end to end of the line."""
    ends = (float(data.points[:, 0].min()), float(data.points[:, 0].max()))
    points = [[at, side, 0.0] for side in (-HALF_GAUGE, HALF_GAUGE) for at in ends]
    return np.array(points), np.array([[0, 1], [2, 3]], dtype=np.int32)
