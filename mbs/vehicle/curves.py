"""Compiled curves: splines, sums of sines, polylines, with their derivatives."""

from __future__ import annotations

import numpy as np

from catenary.solver.base.kernels.compiled import compiled


@compiled
def spline_at(breaks, coefficients, x):
    """Value and two derivatives of a cubic spline at ``x``; ``coefficients`` (n - 1, 4)."""
    i = min(max(np.searchsorted(breaks, x, side="right") - 1, 0), breaks.size - 2)
    d = x - breaks[i]
    c3, c2, c1, c0 = coefficients[i]
    value = ((c3 * d + c2) * d + c1) * d + c0
    return value, (3.0 * c3 * d + 2.0 * c2) * d + c1, 6.0 * c3 * d + 2.0 * c2


@compiled
def sines_at(amplitudes, rates, phases, x):
    """Value and two derivatives at ``x`` of the sum of amplitude sin(rate x + phase)."""
    value, first, second = 0.0, 0.0, 0.0
    for i in range(amplitudes.size):
        angle, rate = rates[i] * x + phases[i], rates[i]
        high = amplitudes[i] * np.sin(angle)
        value += high
        first += amplitudes[i] * rate * np.cos(angle)
        second -= rate * rate * high
    return value, first, second


@compiled
def polyline_at(x, y, places, values, slopes):
    """Values and slopes (s,) of the line through points (x, y) at places; level beyond its ends."""
    for j in range(places.size):
        i = np.searchsorted(x, places[j], side="right") - 1
        if i < 0:
            values[j], slopes[j] = y[0], 0.0
        elif i > x.size - 2:
            values[j], slopes[j] = y[x.size - 1], 0.0
        else:
            slopes[j] = (y[i + 1] - y[i]) / (x[i + 1] - x[i])
            values[j] = y[i] + slopes[j] * (places[j] - x[i])
