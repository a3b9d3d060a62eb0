"""A pantograph as lines: a schematic of two arms and a head, as high as the record says.

The record holds the height of the head. What stands below it is drawn as a lower and an upper arm
of usual lengths, whatever model of the pantograph was simulated.
"""

from __future__ import annotations

import numpy as np

# Lower and upper arm, and half the length of a head along the track [m].
LOWER_ARM, UPPER_ARM, HALF_HEAD = 1.55, 1.95, 0.45
# How far the foot stands ahead of the head, towards the knee [m].
_FOOT_AHEAD = 0.6
# Height of the foot below the head where arms of these lengths stand well [m].
BELOW_HEAD = 1.6


def shape(head: float, foot: float) -> tuple[np.ndarray, np.ndarray]:
    """Foot, knee and hinge of the head, and the ends of the head, as (x, z).

    x [m] counts from the middle of the head in the direction of travel, z [m] from the top of rail.

    Parameters
    ----------
    head, foot : heights [m]; arms are stretched where they would not reach

    Returns
    -------
    arms (3, 2), head (2, 2)
    """
    foot_at, head_at = np.array([_FOOT_AHEAD, foot]), np.array([0.0, head])
    across = head_at - foot_at
    distance = float(np.hypot(*across))
    lower, upper = LOWER_ARM, UPPER_ARM
    longer = max(1.0, 1.001 * distance / (lower + upper))
    lower, upper = longer * lower, longer * upper
    distance = max(distance, 1.001 * abs(upper - lower))
    # Law of cosines: how far along the line from foot to head the knee stands, and beside it.
    along = (lower**2 - upper**2 + distance**2) / (2 * distance)
    beside = np.sqrt(max(lower**2 - along**2, 0.0))
    unit = across / max(float(np.hypot(*across)), 1e-9)
    knee = foot_at + along * unit + beside * np.array([unit[1], -unit[0]])
    arms = np.array([foot_at, knee, head_at])
    return arms, np.array([[-HALF_HEAD, head], [HALF_HEAD, head]])
