"""The loops of a gust field, compiled by Numba."""

from __future__ import annotations

import numpy as np

from catenary.solver.base.kernels.compiled import compiled


@compiled
def bridge(first, last, rates, steps, normals, out):
    """Fill in what lies between two posts of a first-order Gauss-Markov process.

    Parameters
    ----------
    first, last : (k,) at the posts
    rates : (k,) of the decay exp(-rate d) [1/m]
    steps : (m + 1,) from the first post to the point after it, and so on to the last post [m]
    normals, out : (m, k), (m, k) standard normal numbers; values at the m points between
    """
    m, k = out.shape
    left = 0.0
    for j in range(m + 1):
        left += steps[j]
    for j in range(m):
        left -= steps[j]
        for i in range(k):
            before = first[i] if j == 0 else out[j - 1, i]
            near, far = np.exp(-rates[i] * steps[j]), np.exp(-rates[i] * left)
            lost_near = -np.expm1(-2.0 * rates[i] * steps[j])
            lost_far = -np.expm1(-2.0 * rates[i] * left)
            lost = -np.expm1(-2.0 * rates[i] * (steps[j] + left))
            mean = (near * lost_far * before + far * lost_near * last[i]) / lost
            out[j, i] = mean + np.sqrt(lost_near * lost_far / lost) * normals[j, i]


@compiled
def add_waves(waves, amplitudes, out):
    """Add waves (s, k) times amplitudes (k, m) to ``out`` (s, m), in one order for any s, m."""
    s, k = waves.shape
    m = amplitudes.shape[1]
    for i in range(s):
        for j in range(k):
            factor = waves[i, j]
            for p in range(m):
                out[i, p] += factor * amplitudes[j, p]
