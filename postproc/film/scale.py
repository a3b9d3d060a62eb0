"""How places and motions of a line become places in a drawing from the side.

A line is a thousand times longer than it moves. Heights are drawn taller than they are, and what
moves from rest is drawn larger still; both factors stand in the picture.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

# Share of the room between the wires that the largest uplift fills in a drawing.
_SHARE = 0.4


@dataclass(frozen=True)
class Scale:
    """Factors of a drawing: of heights at rest, and of motions from there [-]."""

    height: float
    motion: float

    def drawn(self, rest: np.ndarray, uplift: np.ndarray | float = 0.0) -> np.ndarray:
        """Height in the drawing of what rests at a height [m] and is lifted by ``uplift`` [m]."""
        return np.asarray(self.height * rest + self.motion * uplift)


def scale_for(
    width_m: float,
    room_m: float,
    aspect: float,
    between_wires_m: float,
    largest_uplift_m: float,
    motion: float | None = None,
) -> Scale:
    """The scale that fills a picture.

    Parameters
    ----------
    width_m : length of line in the picture
    room_m : heights from the lowest to the highest thing drawn
    aspect : width of the picture over its height
    between_wires_m : height from the contact wire to what hangs above it at a support
    largest_uplift_m : that is drawn
    motion : the factor of motions if it is given, at least that of heights otherwise
    """
    height = round_down(width_m / aspect / room_m)
    if motion is None:
        wanted = _SHARE * between_wires_m * height / max(largest_uplift_m, 1e-6)
        motion = max(round_down(wanted), height)
    return Scale(height, motion)


def round_down(value: float) -> float:
    """The next smaller of 1, 1.5, 2, 3, 4, 5, 6, 8 times a power of ten."""
    power = 10.0 ** np.floor(np.log10(value))
    steps = np.array([1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0])
    return float(steps[steps <= value / power + 1e-9].max() * power)
