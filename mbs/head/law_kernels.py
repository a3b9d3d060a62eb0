"""The loop of laws that are not linear, compiled by Numba: tables that settle within a step."""

from __future__ import annotations

import numpy as np

from catenary.solver.base.kernels.compiled import called
from catenary.solver.base.kernels.inverse import invert

# Segments of tables mostly settle in two rounds; what goes round in circles is left there.
_MAX_ROUNDS = 20


@called
def settle(laws, newmark, head, position, velocity, base, force, matrix):
    """Add laws to a step's ``force`` (n,) and ``matrix`` (n, n), and invert the latter in place.

    ``position`` and ``velocity`` (n,) are Newmark's predictors, ``base`` height [m] and velocity
    [m/s] of the base. Each law is taken along the segment
    of its table in which the step ends under the contact forces of the step before: first where the
    accelerations of the start lead to, then again until all segments stay.
    """
    state, touch = head.state, head.touch
    n, m = force.size, laws.zero.size
    plain_force, plain_matrix = force.copy(), matrix.copy()
    acceleration = np.empty(n)
    for i in range(n):
        acceleration[i] = state[2 * n + i]
    segment = np.full(m, -1)
    for _ in range(_MAX_ROUNDS):
        changed = False
        for j in range(m):
            at = laws.by_base[j] * base[0] - laws.zero[j]
            if laws.of_rate[j] != 0.0:
                at = laws.by_base[j] * base[1]
            for i in range(n):
                if laws.of_rate[j] != 0.0:
                    value = velocity[i] + newmark.velocity * acceleration[i]
                else:
                    value = position[i] + newmark.position * acceleration[i]
                at += laws.ways[j, i] * value
            low, high = int(laws.first_point[j]), int(laws.first_point[j + 1]) - 2
            k = low
            while k < high and laws.points[k + 1] <= at:
                k += 1
            changed = changed or k != segment[j]
            segment[j] = k
        if not changed:
            break
        for i in range(n):
            force[i] = plain_force[i]
            for k in range(n):
                matrix[i, k] = plain_matrix[i, k]
        for j in range(m):
            k = segment[j]
            slope = (laws.forces[k + 1] - laws.forces[k]) / (laws.points[k + 1] - laws.points[k])
            at, factor = laws.by_base[j] * base[0] - laws.zero[j], newmark.position
            if laws.of_rate[j] != 0.0:
                at, factor = laws.by_base[j] * base[1], newmark.velocity
            for i in range(n):
                at += laws.ways[j, i] * (velocity[i] if laws.of_rate[j] != 0.0 else position[i])
            pull = laws.forces[k] + slope * (at - laws.points[k])
            for i in range(n):
                way = laws.ways[j, i]
                if way != 0.0:
                    force[i] -= way * pull
                    for k in range(n):
                        matrix[i, k] += factor * slope * way * laws.ways[j, k]
        invert(matrix)
        for i in range(n):
            value = 0.0
            for k in range(n):
                push = force[k]
                for j in range(laws.pressed.size):
                    push -= touch[0, j, k] * laws.pressed[j]
                value += matrix[i, k] * push
            acceleration[i] = value
