"""The compiled loops of the estimate of a step's error; see `step_error` for the equation."""

from __future__ import annotations

import numpy as np

from catenary.solver.base.compiled import compiled


@compiled
def largest(time, depth, force, stiffness, compliance, times, depths, forces):
    """Largest error of a force; arguments as those of ``StepError.of`` and its own arrays."""
    largest = 0.0
    for i in range(depth.size):
        touched = forces[i] > 0.0
        if touched or force[i] > 0.0:
            first = (depth[i] - depths[2, i]) / (time - times[2])
            second = (depths[2, i] - depths[1, i]) / (times[2] - times[1])
            third = (depths[1, i] - depths[0, i]) / (times[1] - times[0])
            change = (first - second) / (time - times[1])
            change -= (second - third) / (times[2] - times[0])
            missed = (time - times[2]) ** 2 / 6.0 * abs(change)
            largest = max(largest, stiffness[i] * missed)
        if touched != (force[i] > 0.0):
            turned = np.sqrt(stiffness[i] * compliance[i])
            largest = max(largest, turned * max(forces[i], force[i]))
    return largest


@compiled
def remember(time, depth, force, times, depths, forces):
    """Put a step behind those of the past, of which the oldest is forgotten."""
    for row in range(times.size - 1):
        times[row] = times[row + 1]
        depths[row] = depths[row + 1]
    times[-1] = time
    depths[-1] = depth
    for i in range(depth.size):
        forces[i] = force[i]
