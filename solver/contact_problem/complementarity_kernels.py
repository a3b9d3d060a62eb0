"""The compiled loops of the small problem: contact forces, switching links, contact laws.

Not collective; see `complementarity` for the equations, `base.compiled` for how they are compiled.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from catenary.solver.base.kernels.compiled import compiled, in_line, inner
from catenary.solver.contact.line_response import Affine, Bounds, Coupled, Rows


class Tangents(NamedTuple):
    """own f = offset + by_depth d + by_rate d' at n contacts, with depth d and rate d' of the gap
    under forces f; (n,) each [-], [N], [N/m], [N s/m]."""

    own: np.ndarray
    offset: np.ndarray
    by_depth: np.ndarray
    by_rate: np.ndarray


class Unknowns(NamedTuple):
    """Room for the small problem with up to k unknowns: the contact forces, then compensations.

    ``always`` (k,) tells which may have any sign; ``behind`` (k,) of a rider's how many rows its
    master's is before it, which it acts with, 0 of others.
    """

    always: np.ndarray
    behind: np.ndarray
    matrix: np.ndarray
    right: np.ndarray
    solution: np.ndarray


class SmallProblem(NamedTuple):
    """Arguments of ``solve``.

    Attributes
    ----------
    heads, line, gap : Affine at the contacts of both sides, and of the depths between them
    present : (n,) 1 for contacts whose wire is on the strip, else 0
    pulls : whether forces of those that are may have any sign
    flags : (1,) of ``line_response.FLAGS``, of which the number of rows is read
    rows : Rows of links that may switch
    bounds : Bounds of these rows
    tangents : of the contact law
    coupled : all links
    unknowns : room for the problem, in which the solution is left
    found : (2, n) depths and rates at the contacts under the solution
    max_rounds : of the active-set iteration
    """

    heads: Affine
    line: Affine
    gap: Affine
    present: np.ndarray
    pulls: bool
    flags: np.ndarray
    rows: Rows
    bounds: Bounds
    tangents: Tangents
    coupled: Coupled
    unknowns: Unknowns
    found: np.ndarray
    max_rounds: int


# Depth where there is no wire on a strip [m]: out of contact, whatever the law.
NOWHERE = -1.0


@in_line
def subtract(heads, line, present, gap):
    """Depths and rates at the contacts without forces, and what forces take off them, into ``gap``.

    Returns whether all of it is finite.
    """
    total, n = 0.0, gap.place.size
    for i in range(n):
        gap.place[i] = heads.place[i] - line.place[i] if present[i] else NOWHERE
        gap.rate[i] = heads.rate[i] - line.rate[i] if present[i] else 0.0
        total += gap.place[i] + gap.rate[i]
        for j in range(n):
            gap.by_force[i, j] = present[i] * (heads.by_force[i, j] + line.by_force[i, j])
            by_rate = heads.rate_by_force[i, j] + line.rate_by_force[i, j]
            gap.rate_by_force[i, j] = present[i] * by_rate
            total += gap.by_force[i, j] + gap.rate_by_force[i, j]
    return np.isfinite(total)


@inner
def press(gap, tangents, push, softness):
    """Right-hand side and matrix of the contact forces when no link has switched."""
    own, offset, by_depth, by_rate = tangents
    depth, rate, by_force, rate_by_force = gap
    for i in range(depth.size):
        push[i] = offset[i] + by_depth[i] * depth[i] + by_rate[i] * rate[i]
        for j in range(depth.size):
            softness[i, j] = by_depth[i] * by_force[i, j] + by_rate[i] * rate_by_force[i, j]
        softness[i, i] += own[i]


@compiled
def hertz(depth, rate, speed, stiffness, exponent, hysteresis, tangents, force):
    """Tangents of f = K d^n (1 + chi d' / d0') at each contact, with f and what f is less them."""
    _, offset, by_depth, by_rate = tangents
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


@in_line
def any_switched(rows, count, coupled, force):
    """Whether contact forces alone take any of the links beyond its reserve."""
    for d in range(count):
        if coupled.behind[int(rows.number[d])] > 0:
            continue
        value = rows.reserve[d]
        for i in range(force.size):
            value += rows.reaction[d, i] * force[i]
        if value < 0.0:
            return True
    return False


@compiled
def couple(rows, count, coupled, by_depth, by_rate, behind, matrix, right):
    """The rows and columns of links beside those of the n contacts, which stand there, and which of
    them are ``behind`` a master.

    ``by_depth`` and ``by_rate`` (n,) are what depth and rate are worth at each contact.
    """
    band, n = coupled.band, by_depth.size
    half = band.shape[1] // 2
    for d in range(count):
        row, number = n + d, int(rows.number[d])
        released = coupled.released[number]
        behind[row] = coupled.behind[number]
        right[row] = -released * rows.reserve[d]
        for i in range(n):
            matrix[row, i] = released * rows.reaction[d, i]
            matrix[i, row] = -(by_depth[i] * rows.lift[d, i] + by_rate[i] * rows.rise[d, i])
        for e in range(count):
            other = int(rows.number[e])
            offset = number - other + half
            value = 0.0
            if 0 <= offset < band.shape[1]:
                value = -released * band[other, offset]
            matrix[row, n + e] = value
        matrix[row, row] += 1.0


@inner
def solve_two(matrix, right, acts, solution):
    """The same for two that act, in the same order of operations."""
    first = 0
    while not acts[first]:
        first += 1
    second = first + 1
    while not acts[second]:
        second += 1
    top, low = first, second
    if abs(matrix[second, first]) > abs(matrix[first, first]):
        top, low = second, first
    share = matrix[low, first] / matrix[top, first]
    pivot = matrix[low, second] - share * matrix[top, second]
    x, y = 0.0, 0.0
    for _ in range(2):
        of_top = right[top] - matrix[top, first] * x - matrix[top, second] * y
        of_low = right[low] - matrix[low, first] * x - matrix[low, second] * y
        change = (of_low - share * of_top) / pivot
        y += change
        x += (of_top - matrix[top, second] * change) / matrix[top, first]
    solution[first], solution[second] = x, y


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
    if m == 2:
        # Two contacts and taut droppers: without arrays.
        solve_two(matrix, right, acts, solution)
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
def settle(matrix, right, always, behind, solution, max_rounds):
    """Active-set iteration for x = max(0, x - (matrix x - right)), freely where ``always``, and
    freely with another before it where ``behind`` one.

    Returns the rounds needed, which are not positive if the set did not settle.
    """
    n = right.size
    acts = np.empty(n, dtype=np.bool_)
    for i in range(n):
        acts[i] = acts[i - behind[i]] if behind[i] else always[i] or right[i] > 0.0
    for rounds in range(1, max_rounds + 1):
        solve_on(matrix, right, acts, solution)
        changed = False
        for i in range(n):
            if behind[i]:
                acts[i] = acts[i - behind[i]]
                continue
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


@in_line
def under(gap, rows, force, compensation, found):
    """Fill ``found`` (2, n): depths and rates at the contacts under forces and compensations.

    Returns whether all of them are finite.
    """
    total = 0.0
    for i in range(force.size):
        d, r = gap.place[i], gap.rate[i]
        for j in range(force.size):
            d -= gap.by_force[i, j] * force[j]
            r -= gap.rate_by_force[i, j] * force[j]
        for k in range(compensation.size):
            d += rows.lift[k, i] * compensation[k]
            r += rows.rise[k, i] * compensation[k]
        found[0, i], found[1, i] = d, r
        total += d + r
    return np.isfinite(total)


@in_line
def leaves_out(force, compensation, rows, bounds, coupled):
    """Whether a link without a row may have switched, as the ``bounds`` were too small.

    That is, a contact force is beyond its limit or compensations (m,) take more than the limit off
    the reserve of a link elsewhere.
    """
    band, drop = coupled.band, coupled.drop
    half, n = band.shape[1] // 2, drop.size
    if n == 0:
        return False
    for i in range(force.size):
        if force[i] > bounds.push[i] or -force[i] > bounds.pull[i]:
            return True
    largest = 0.0
    for k in range(compensation.size):
        if compensation[k] != 0.0:
            e = int(rows.number[k])
            for d in range(max(0, e - half), min(n, e + half + 1)):
                if coupled.released[d] > 0.0 and coupled.behind[d] == 0:
                    drop[d] += compensation[k] * band[e, d - e + half]
    for k in range(compensation.size):
        drop[int(rows.number[k])] = 0.0
    for k in range(compensation.size):
        if compensation[k] != 0.0:
            e = int(rows.number[k])
            for d in range(max(0, e - half), min(n, e + half + 1)):
                largest = max(largest, drop[d])
                drop[d] = 0.0
    return largest > bounds.loss[0]


@in_line
def solve(problem):
    """Contact forces and compensations for a law's tangents: rounds needed, and unknowns used.

    Returned last are whether depths and rates under them are finite, and whether all links that
    have switched had a row, see ``leaves_out``.

    If no contact force takes a link beyond its reserve there are n unknowns, else n + the number of
    rows. Rounds are not positive if the active set did not settle; the problem then stands in
    matrix and right-hand side.
    """
    heads, line, gap, present, pulls, flags, rows, bounds = problem[:8]
    tangents, coupled, unknowns, found, max_rounds = problem[8:]
    always, behind, matrix, right, solution = unknowns
    n, count = gap.place.size, int(flags[0].rows)
    finite = subtract(heads, line, present, gap)
    for i in range(n):
        always[i] = pulls and present[i] != 0.0
        behind[i] = 0
    press(gap, tangents, right, matrix)
    force = solution[:n]
    rounds = settle(matrix[:n, :n], right[:n], always[:n], behind[:n], force, max_rounds)
    size = n
    if rounds > 0 and any_switched(rows, count, coupled, force):
        worth = tangents.by_depth, tangents.by_rate
        couple(rows, count, coupled, *worth, behind, matrix, right)
        size = n + count
        kinds = always[:size], behind[:size]
        rounds = settle(matrix[:size, :size], right[:size], *kinds, solution[:size], max_rounds)
    finite &= under(gap, rows, force, solution[n:size], found)
    complete = not leaves_out(force, solution[n:size], rows, bounds, coupled)
    return rounds, size, finite, complete
