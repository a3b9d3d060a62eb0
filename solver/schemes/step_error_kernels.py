"""The compiled loops of the estimate of a step's error; see `step_error` for the equation."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from catenary.solver.base.kernels.compiled import compiled


class Past(NamedTuple):
    """The latest steps, oldest first.

    Attributes
    ----------
    times : (3,) their ends [s]
    depths : (3, n) of n contacts [m]
    forces : (n,) at the end of the last [N]
    """

    times: np.ndarray
    depths: np.ndarray
    forces: np.ndarray


class Tried(NamedTuple):
    """A step that is judged.

    Attributes
    ----------
    depth, force, stiffness : (n,) found there [m], [N], [N/m], the latter of the law's tangent
    compliance : (n,) what a force takes off the depth within the step [m/N]
    """

    depth: np.ndarray
    force: np.ndarray
    stiffness: np.ndarray
    compliance: np.ndarray


@compiled
def largest(tried, past, time):
    """Largest error of a contact force by a step to ``time`` [N]."""
    times, depths = past.times, past.depths
    largest = 0.0
    for i in range(tried.depth.size):
        before, now = past.forces[i], tried.force[i]
        if before > 0.0 or now > 0.0:
            first = (tried.depth[i] - depths[2, i]) / (time - times[2])
            second = (depths[2, i] - depths[1, i]) / (times[2] - times[1])
            third = (depths[1, i] - depths[0, i]) / (times[1] - times[0])
            change = (first - second) / (time - times[1])
            change -= (second - third) / (times[2] - times[0])
            missed = (time - times[2]) ** 2 / 6.0 * abs(change)
            largest = max(largest, tried.stiffness[i] * missed)
        if (before > 0.0) != (now > 0.0):
            turned = np.sqrt(tried.stiffness[i] * tried.compliance[i])
            largest = max(largest, turned * max(before, now))
    return largest


@compiled
def remember(tried, past, time):
    """Append a step to ``time`` to those of the past and drop the oldest."""
    times, depths, forces = past
    for row in range(times.size - 1):
        times[row] = times[row + 1]
        depths[row] = depths[row + 1]
    times[-1] = time
    depths[-1] = tried.depth
    for i in range(forces.size):
        forces[i] = tried.force[i]
