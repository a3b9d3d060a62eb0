"""The compiled loops of the inner problem: contact forces, slack droppers, contact laws.

Not collective; see `complementarity` for the equations, `base.compiled` for how they are compiled.
"""

from __future__ import annotations

import numpy as np

from catenary.solver.base.compiled import compiled
from catenary.solver.contact.contact_kernels import parts
from catenary.solver.contact.line_response import COUPLINGS, FLAGS, NUMBER, TENSION


@compiled
def gap(heads, line, n, numbers):
    """Depths and rates at n contacts without forces, and what forces take off them.

    Three arrays (2 n + 2 n^2,) of heights, rates, and what forces change of both: of ``heads``,
    ``line``, and of the gap between them. Returns whether all of it are numbers.
    """
    total = 0.0
    for i in range(numbers.size):
        numbers[i] = heads[i] - line[i] if i < 2 * n else heads[i] + line[i]
        total += numbers[i]
    return np.isfinite(total)


@compiled
def press(numbers, tangents, push, softness):
    """Right-hand side and matrix of the contact forces when no dropper is slack.

    ``tangents`` (4, n) are own f = offset + by_depth d + by_rate d' at each contact, with depth d
    and rate d' of the gap under forces f.
    """
    own, offset, by_depth, by_rate = tangents
    depth, rate, by_force, rate_by_force = parts(numbers, own.size)
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
def any_pushed(rows, count, n, force):
    """Whether contact forces alone leave any of the droppers in compression."""
    for d in range(count):
        value = rows[d, TENSION]
        for i in range(n):
            value += rows[d, COUPLINGS + i] * force[i]
        if value < 0.0:
            return True
    return False


@compiled
def couple(rows, count, n, released, band, push, matrix, right):
    """The rows and columns of slack droppers beside those of the contacts, which stand there.

    ``band[e, d - e + half]`` is by how much a unit compensation of dropper e takes off the
    tension of dropper d; ``push`` (2, n) holds what depth and rate are worth at each contact.
    """
    half = band.shape[1] // 2
    for d in range(count):
        row = n + d
        right[row] = -released * rows[d, TENSION]
        for i in range(n):
            matrix[row, i] = released * rows[d, COUPLINGS + i]
            lifted, rising = rows[d, COUPLINGS + n + i], rows[d, COUPLINGS + 2 * n + i]
            matrix[i, row] = -(push[0, i] * lifted + push[1, i] * rising)
        for e in range(count):
            offset = int(rows[d, NUMBER]) - int(rows[e, NUMBER]) + half
            value = 0.0
            if 0 <= offset < band.shape[1]:
                value = -released * band[int(rows[e, NUMBER]), offset]
            matrix[row, n + e] = value
        matrix[row, row] += 1.0


@compiled
def solve_on(matrix, right, acts, solution):
    """Solution of the rows and columns that act, zero elsewhere, by elimination with pivoting.

    Rows may differ by orders of magnitude, as those of contacts with a law of impact and of
    droppers do: elimination leaves the round-off of the largest in all. One refinement makes what
    is left small beside the terms of each row (R. D. Skeel, Math. Comp. 35 (1980) 817-832).
    """
    m, last = 0, 0
    for i in range(acts.size):
        solution[i] = 0.0
        if acts[i]:
            m, last = m + 1, i
    if m < 2:
        # One contact and taut droppers, mostly.
        if m:
            solution[last] = right[last] / matrix[last, last]
        return
    index = np.flatnonzero(acts)
    a, order = np.empty((m, m)), np.arange(m)
    for i in range(m):
        for j in range(m):
            a[i, j] = matrix[index[i], index[j]]
    for k in range(m):
        pivot = k
        for i in range(k + 1, m):
            if abs(a[i, k]) > abs(a[pivot, k]):
                pivot = i
        if pivot != k:
            order[k], order[pivot] = order[pivot], order[k]
            for j in range(m):
                a[k, j], a[pivot, j] = a[pivot, j], a[k, j]
        for i in range(k + 1, m):
            a[i, k] /= a[k, k]
            for j in range(k + 1, m):
                a[i, j] -= a[i, k] * a[k, j]
    left, change = np.empty(m), np.empty(m)
    for _ in range(2):
        for i in range(m):
            value = right[index[i]]
            for j in range(m):
                value -= matrix[index[i], index[j]] * solution[index[j]]
            left[i] = value
        for i in range(m):
            value = left[order[i]]
            for j in range(i):
                value -= a[i, j] * change[j]
            change[i] = value
        for i in range(m - 1, -1, -1):
            value = change[i]
            for j in range(i + 1, m):
                value -= a[i, j] * change[j]
            change[i] = value / a[i, i]
            solution[index[i]] += change[i]


@compiled
def settle(matrix, right, always, solution, max_rounds):
    """Active-set iteration for x = max(0, x - (matrix x - right)), freely where ``always``.

    Returns the rounds needed, which are not positive if the set did not settle.
    """
    n = right.size
    acts = np.empty(n, dtype=np.bool_)
    for i in range(n):
        acts[i] = always[i] or right[i] > 0.0
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
            return rounds
    return -max_rounds


@compiled
def under(numbers, rows, count, force, slack, found):
    """Fill ``found`` (2, n): depths and rates at the contacts under forces and compensations.

    Returns whether all of them are numbers.
    """
    n, total = found.shape[1], 0.0
    depth, rate, by_force, rate_by_force = parts(numbers, n)
    for i in range(n):
        d, r = depth[i], rate[i]
        for j in range(n):
            d -= by_force[i, j] * force[j]
            r -= rate_by_force[i, j] * force[j]
        for k in range(count):
            d += rows[k, COUPLINGS + n + i] * slack[k]
            r += rows[k, COUPLINGS + 2 * n + i] * slack[k]
        found[0, i], found[1, i] = d, r
        total += d + r
    return np.isfinite(total)


@compiled
def leaves_out(force, slack, rows, limits, band, drop):
    """Whether a dropper without a row may have gone slack, as the ``limits`` were too small.

    That is, a contact force is beyond its limit or compensations (``slack.size``,) take more than
    the margin, the last of the limits, off a dropper elsewhere. ``drop`` (n_droppers,) is room to
    work, all zero before and after.
    """
    half, n = band.shape[1] // 2, drop.size
    if n == 0:
        return False
    for i in range(force.size):
        if force[i] > limits[i]:
            return True
    largest = 0.0
    for k in range(slack.size):
        if slack[k] != 0.0:
            e = int(rows[k, NUMBER])
            for d in range(max(0, e - half), min(n, e + half + 1)):
                drop[d] += slack[k] * band[e, d - e + half]
    for k in range(slack.size):
        drop[int(rows[k, NUMBER])] = 0.0
    for k in range(slack.size):
        if slack[k] != 0.0:
            e = int(rows[k, NUMBER])
            for d in range(max(0, e - half), min(n, e + half + 1)):
                largest = max(largest, drop[d])
                drop[d] = 0.0
    return largest > limits[force.size]


@compiled
def solve(
    heads,
    line,
    rows,
    limits,
    numbers,
    tangents,
    released,
    band,
    always,
    matrix,
    right,
    solution,
    found,
    drop,
    max_rounds,
):
    """Contact forces and compensations for a law's tangents: rounds needed, and unknowns used.

    ``line`` is ``LineResponse.summed``, ``heads`` and ``numbers`` are those of ``gap``. ``found``
    (2, n) becomes depths and rates at the contacts; returned last are whether all of them are
    finite, and whether all droppers that are slack had a row, see ``leaves_out``.

    If no contact force pushes a dropper together there are n unknowns, else n + ``count``. Rounds
    are not positive if the active set did not settle; the problem then stands in ``matrix`` and
    ``right``.
    """
    n, count = tangents.shape[1], int(line[0])
    finite = gap(heads, line[FLAGS : FLAGS + numbers.size], n, numbers)
    press(numbers, tangents, right, matrix)
    rounds = settle(matrix[:n, :n], right[:n], always[:n], solution[:n], max_rounds)
    size = n
    if rounds > 0 and any_pushed(rows, count, n, solution):
        couple(rows, count, n, released, band, tangents[2:], matrix, right)
        size = n + count
        rounds = settle(
            matrix[:size, :size], right[:size], always[:size], solution[:size], max_rounds
        )
    finite &= under(numbers, rows, size - n, solution, solution[n:], found)
    complete = not leaves_out(solution[:n], solution[n:size], rows, limits, band, drop)
    return rounds, size, finite, complete
