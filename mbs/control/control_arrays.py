"""Settings, gains and memory of a regulated lift as arrays, and what stands where in them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

# What ``settings`` hold: 1 if the head's height is measured, 0 for the contact force; the wanted
# value [m] or [N]; what a step takes of the difference to what is filtered [-]; step, time between
# samples [s]; least and largest added force [N].
HEIGHT, TARGET, PART, DT, SAMPLE, LEAST, MOST = range(7)
N_SETTINGS = 7
# What ``memory`` holds: the time [s]; when the next sample is [s]; what was measured, filtered;
# the integral of the error [.. s]; the last sample's error; how many samples there were; the added
# force that acts [N]; behind that forces that wait.
TIME, NEXT, FILTERED, INTEGRAL, ERROR, SAMPLES, ACTING = range(7)
WAITING = 7


class ControlArrays(NamedTuple):
    """A controller's ``settings`` (N_SETTINGS,); ``gains`` (g, 4), rows of a measured value and the
    gains of error, integral and rate there, straight in between; ``memory`` (WAITING + delay,)."""

    settings: np.ndarray
    gains: np.ndarray
    memory: np.ndarray
