"""The loops of a time step, compiled by Numba: state updates, contacts, droppers, superposition.

Each works on this rank's arrays and knows nothing of MPI or PETSc. Not collective. Numba keeps
the compiled code beside the sources (or in the user's cache), so that only the first run waits.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from catenary.solver.elements import shape_slopes, shape_values

# Cancellation-free arithmetic matters more than the last per cent: no fastmath, same answer as
# the formulas and on every rank.
compiled = njit(cache=True, error_model="numpy")


@compiled
def predict(displacement, velocity, acceleration, work, dt, c_position, c_velocity, c_work):
    """Predictions of eq. (2.5) in place; ``work`` becomes -(d + ``c_work`` v)."""
    for i in range(displacement.size):
        d = displacement[i] + dt * velocity[i] + c_position * acceleration[i]
        v = velocity[i] + c_velocity * acceleration[i]
        displacement[i] = d
        velocity[i] = v
        work[i] = -(d + c_work * v)


@compiled
def correct(displacement, velocity, acceleration, position_factor, velocity_factor, damping_share):
    """New displacement and velocity from predictions and acceleration (eq. 2.6).

    The acceleration still lacks -``damping_share`` v, the part of damping on mass.
    """
    for i in range(displacement.size):
        acceleration[i] -= damping_share * velocity[i]
        displacement[i] += position_factor * acceleration[i]
        velocity[i] += velocity_factor * acceleration[i]


@compiled
def locate(
    x,
    nodes,
    local_of_node,
    owned,
    rest_of_node,
    element,
    local,
    value,
    slope,
    whole_value,
    whole_slope,
    rest,
):
    """Element, Hermite functions and unknowns at each position ``x``; see ``contact.Touches``."""
    for i in range(x.size):
        e = min(max(np.searchsorted(nodes, x[i]) - 1, 0), nodes.size - 2)
        length = nodes[e + 1] - nodes[e]
        xi = (x[i] - nodes[e]) / length
        element[i] = e
        whole_value[i] = shape_values(xi, length)
        whole_slope[i] = shape_slopes(xi, length)
        for k in range(4):
            node, unknown = e + k // 2, k % 2
            local[i, k] = local_of_node[node, unknown]
            rest[i, k] = rest_of_node[node, unknown]
            value[i, k] = whole_value[i, k] * owned[node, unknown]
            slope[i, k] = whole_slope[i, k] * owned[node, unknown]


@compiled
def heights(displacement, velocity, local, value, slope, rest, train_speed, height, rate):
    """Owned share of the wire's height and of its total rate dw/dt + V dw/dx at each touch."""
    for i in range(local.shape[0]):
        w, rising, steep = 0.0, 0.0, 0.0
        for k in range(4):
            total = rest[i, k]
            if displacement.size:
                total += displacement[local[i, k]]
                rising += value[i, k] * velocity[local[i, k]]
            w += value[i, k] * total
            steep += slope[i, k] * total
        height[i] = w
        rate[i] = rising + train_speed * steep


@compiled
def combine(elements, weights, first_node, start, offset, data, answers, filled):
    """Answer to a unit force in each element: columns of its four unknowns, weighted.

    ``data[offset[k] : offset[k + 1]]`` holds the two columns of node k one after the other, which
    begin at the local unknown ``start[k]``. ``answers`` (n, n_local) is cleared where it was
    ``filled`` (n, 2) and filled anew.
    """
    for i in range(elements.size):
        answers[i, filled[i, 0] : filled[i, 1]] = 0.0
        low, high = answers.shape[1], 0
        for side in range(2):
            node = elements[i] - first_node + side
            width = (offset[node + 1] - offset[node]) // 2
            if width == 0:
                continue
            begin, at = start[node], offset[node]
            by_height, by_slope = weights[i, 2 * side], weights[i, 2 * side + 1]
            for j in range(width):
                answers[i, begin + j] += by_height * data[at + j] + by_slope * data[at + width + j]
            low = min(low, begin)
            high = max(high, begin + width)
        filled[i, 0] = min(low, high)
        filled[i, 1] = high


@compiled
def influence(answers, local, weights, result):
    """``result[i, j]`` = interpolation at touch i of the answer to force j."""
    if answers.shape[1] == 0:
        return
    for i in range(local.shape[0]):
        for j in range(answers.shape[0]):
            total = 0.0
            for k in range(4):
                total += weights[i, k] * answers[j, local[i, k]]
            result[i, j] = total


@compiled
def tension(displacement, velocity, upper, lower, rest, stiffness, damping, result):
    """Tension N0 + k e + c e' of droppers as if they could push [N]."""
    for d in range(upper.size):
        stretch = displacement[upper[d]] - displacement[lower[d]]
        speed = velocity[upper[d]] - velocity[lower[d]]
        result[d] = rest[d] + stiffness[d] * stretch + damping[d] * speed


@compiled
def may_slacken(
    force, margin, bound, per_acceleration, upper, lower, x, contact_x, reach, answers, chosen
):
    """Number of droppers, listed in ``chosen``, whose tension may fall below ``margin``.

    Contact i may press with up to ``bound[i]`` and touches those within ``reach`` of it.
    """
    count = 0
    for d in range(force.size):
        candidate = force[d] < margin
        if not candidate:
            for i in range(contact_x.size):
                if abs(x[d] - contact_x[i]) <= reach:
                    spread = answers[i, upper[d]] - answers[i, lower[d]]
                    if force[d] + per_acceleration[d] * spread * bound[i] < margin:
                        candidate = True
                        break
        if candidate:
            chosen[count] = d
            count += 1
    return count


@compiled
def move(begin, values, factor, acceleration, displacement, velocity, c_position, c_velocity):
    """Add ``factor`` times a column to the acceleration, and what follows to the state."""
    for j in range(values.size):
        change = factor * values[j]
        acceleration[begin + j] += change
        displacement[begin + j] += c_position * change
        velocity[begin + j] += c_velocity * change


@compiled
def press(depth, rate, by_force, rate_by_force, own, offset, by_depth, by_rate, push, softness):
    """Right-hand side and matrix of the contact forces when no dropper is slack.

    ``own`` f = ``offset`` + ``by_depth`` d + ``by_rate`` d' at each contact, with depth d and rate
    d' that are ``depth`` - ``by_force`` f and ``rate`` - ``rate_by_force`` f.
    """
    for i in range(depth.size):
        push[i] = offset[i] + by_depth[i] * depth[i] + by_rate[i] * rate[i]
        for j in range(depth.size):
            softness[i, j] = by_depth[i] * by_force[i, j] + by_rate[i] * rate_by_force[i, j]
        softness[i, i] += own[i]


@compiled
def hertz(depth, rate, speed, stiffness, exponent, hysteresis, offset, by_depth, by_rate, force):
    """Tangents of f = K d^n (1 + chi d' / d0') at each contact, with f and what f is less them."""
    for i in range(depth.size):
        d = depth[i]
        if d <= 0.0:
            offset[i] = by_depth[i] = by_rate[i] = force[i] = 0.0
            continue
        spring = stiffness * d**exponent
        loss = 1.0 + hysteresis * rate[i] / speed[i]
        force[i] = spring * loss
        by_depth[i] = exponent * spring / d * loss
        by_rate[i] = spring * hysteresis / speed[i]
        if by_depth[i] < 0.0:
            # Beyond the speed at which the law would pull it has no spring either.
            by_depth[i] = 0.0
        offset[i] = force[i] - by_depth[i] * d - by_rate[i] * rate[i]


@compiled
def any_pushed(free_tension, by_force, force):
    """Whether contact forces alone leave any of the droppers in compression."""
    for d in range(free_tension.size):
        value = free_tension[d]
        for i in range(force.size):
            value += by_force[d, i] * force[i]
        if value < 0.0:
            return True
    return False


@compiled
def solve_on(matrix, right, acts, solution):
    """Solution of the rows and columns that act, zero elsewhere, by elimination with pivoting."""
    index = np.flatnonzero(acts)
    m = index.size
    a = np.empty((m, m + 1))
    for i in range(m):
        for j in range(m):
            a[i, j] = matrix[index[i], index[j]]
        a[i, m] = right[index[i]]
    for k in range(m):
        pivot = k
        for i in range(k + 1, m):
            if abs(a[i, k]) > abs(a[pivot, k]):
                pivot = i
        if pivot != k:
            for j in range(k, m + 1):
                a[k, j], a[pivot, j] = a[pivot, j], a[k, j]
        for i in range(k + 1, m):
            share = a[i, k] / a[k, k]
            for j in range(k + 1, m + 1):
                a[i, j] -= share * a[k, j]
    solution[:] = 0.0
    for i in range(m - 1, -1, -1):
        value = a[i, m]
        for j in range(i + 1, m):
            value -= a[i, j] * solution[index[j]]
        solution[index[i]] = value / a[i, i]


@compiled
def settle(matrix, right, always, max_rounds):
    """Active-set iteration for x = max(0, x - (matrix x - right)), freely where ``always``.

    Returns the solution and the rounds needed, which are negative if the set did not settle.
    """
    n = right.size
    acts = np.empty(n, dtype=np.bool_)
    for i in range(n):
        acts[i] = always[i] or right[i] > 0.0
    solution = np.zeros(n)
    for rounds in range(1, max_rounds + 1):
        solve_on(matrix, right, acts, solution)
        changed = False
        for i in range(n):
            residual = -right[i]
            for j in range(n):
                residual += matrix[i, j] * solution[j]
            now = always[i] or solution[i] - residual > 0.0
            if now != acts[i]:
                acts[i] = now
                changed = True
        if not changed:
            return solution, rounds
    return solution, -max_rounds


def warm_up() -> None:
    """Compile all kernels, or load them from Numba's cache, before the clock of a march starts."""
    reals, numbers = np.zeros(4), np.zeros(1, dtype=np.int64)
    one, table, places = np.zeros(1), np.zeros((1, 4)), np.zeros((1, 4), dtype=np.int64)
    nodes, range_filled = np.array([0.0, 1.0]), np.zeros((1, 2), dtype=np.int64)
    pairs, columns = np.zeros((2, 2)), np.zeros(0)
    predict(reals, reals, reals, reals, 1.0, 1.0, 1.0, 1.0)
    correct(reals, reals, reals, 1.0, 1.0, 1.0)
    locate(
        one,
        nodes,
        np.zeros((2, 2), dtype=np.int64),
        pairs,
        pairs,
        numbers,
        places,
        table,
        table,
        table,
        table,
        table,
    )
    heights(reals, reals, places, table, table, table, 1.0, one, one)
    bounds = np.zeros(3, dtype=np.int64)
    combine(numbers, table, 0, bounds, bounds, columns, table, range_filled)
    influence(table, places, table, np.zeros((1, 1)))
    tension(reals, reals, numbers, numbers, one, one, one, one)
    may_slacken(one, 1.0, one, one, numbers, numbers, one, one, 1.0, table, numbers)
    move(0, reals, 1.0, reals, reals, reals, 1.0, 1.0)
    press(one, one, np.eye(1), np.eye(1), one, one, one, one, one, np.eye(1))
    hertz(one, one, one, 1.0, 1.5, 0.0, one, one, one, one)
    any_pushed(one, np.eye(1), one)
    settle(np.eye(1), one, np.zeros(1, dtype=np.bool_), 1)
