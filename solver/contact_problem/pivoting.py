"""What finds a step's forces where the active set cycles: pivoting, and riders that carry in part.

Contacts and links alone are a linear complementarity problem with a P-matrix, which pivoting
solves. Bends of one link, and a wheel that slips one way or the other, have a row each, of which
some act only where others do, and some only where others do not. Sets are taken that belong to a
place along the link: with others the matrix is none. So a link goes from piece to piece of its law,
one at a time, and with a law that rises all over it does not come back to one: with all rows before
its own solved for, what it lacks has one sign to either side of where it stays.

Nor is the matrix one with riders: what a dropper does across it is whole while it is taut and
nothing while it is slack, whatever its tension, so that it jumps where that passes zero. If the
jump tightens the dropper that slackens, it is neither taut nor slack. The step then ends with its
tension at zero and riders that carry in part (docs/theory/lateral.md).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from catenary.base.errors import NotConverged
from catenary.solver.contact_problem.dense_systems import System, room_for
from catenary.solver.contact_problem.simplicial_path import find_zero
from catenary.solver.kernels import native

# Shares go from 0 to 1; paths on a grid of some of that take the fewest steps.
_FIRST_GRID = 0.25
# What may be missing in a row, of the largest right-hand side; and, as that makes the problem jump
# from shares to shares, what shares and tensions may disagree by.
_ROUNDING = 1e-12
_AGREEMENT = 10.0 * _ROUNDING
# Rows of bends along one direction differ by this at most, of their largest number.
_ALIKE = 1e-9
# Problems that one step may solve on its way to shares: some ten seconds.
_MOST_LOOKS = 100_000


def pivot(
    matrix: np.ndarray,
    right: np.ndarray,
    always: np.ndarray,
    behind: np.ndarray,
    solution: np.ndarray,
) -> int:
    """Murty's least-index pivoting: slower, but it cannot cycle for a P-matrix. Riders go with
    their masters, in part if there is no other solution.

    Fills the solution and returns the rounds needed.

    Raises
    ------
    NotConverged
        If there is no solution.
    """
    acts, along = always.copy(), _along(matrix, right)
    found, rounds, circle = _pivot(matrix, right, always, behind, along, solution, acts)
    if not found and behind.any():
        found, more = _share(matrix, right, always, behind, along, solution, acts, circle)
        rounds += more
    if not found:
        raise NotConverged(
            "contacts and slack droppers of this step have no common solution; take a smaller "
            "numerics.dt_s or less contact damping"
        )
    return rounds


class _Along(NamedTuple):
    """How rows of bends along one direction go with each other: ``needs[i, j]`` says that i acts
    only while j does, ``excludes[i, j]`` that it does not while j does."""

    needs: np.ndarray
    excludes: np.ndarray


def _along(matrix: np.ndarray, right: np.ndarray) -> _Along:
    """Rows of bends along one direction: but for a unit matrix they are multiples of one row u,
    c u, and act where u x is below right / c of a positive c, and above it of a negative one."""
    beside = matrix - np.eye(right.size)
    size = np.abs(beside).max(axis=1, initial=0.0)
    scaled = np.divide(beside, size[:, None], out=np.zeros_like(beside), where=size[:, None] > 0.0)
    length = np.linalg.norm(scaled, axis=1)
    cosine = np.abs(scaled @ scaled.T) - (1.0 - _ALIKE) * np.outer(length, length)
    needs, excludes = np.zeros((2, *matrix.shape), dtype=bool)
    for i, j in np.argwhere((cosine > 0.0) & ~np.eye(right.size, dtype=bool)):
        sign = np.sign(scaled[i] @ scaled[j])
        if np.abs(scaled[i] - sign * scaled[j]).max() > _ALIKE:
            continue
        # Where along u of row i both begin to act, i below its place.
        place, other = right[i] / size[i], sign * right[j] / size[j]
        needs[i, j] = sign > 0.0 and other > place
        excludes[i, j] = sign < 0.0 and other >= place
    return _Along(needs, excludes)


def _pivot(
    matrix: np.ndarray,
    right: np.ndarray,
    always: np.ndarray,
    behind: np.ndarray,
    along: _Along,
    solution: np.ndarray,
    acts: np.ndarray,
) -> tuple[bool, int, np.ndarray]:
    """Whether a set was right, the rounds to get there from ``acts``, which it overwrites, and, if
    it was not, the rows that go round in a circle of sets."""
    master = np.arange(behind.size) - behind
    scale = _ROUNDING * (1.0 + np.abs(right).max())
    most = 20 * right.size + 100
    system, room = System(matrix, right, solution), room_for(right.size)
    turned: list[int] = []
    seen: dict[bytes, int] = {}
    for rounds in range(1, most):
        since = seen.setdefault(acts.tobytes(), len(turned))
        if since < len(turned):  # each set has one that follows it, so they come again for ever
            return False, rounds, np.unique(turned[since:])
        native.solve_on(system, acts, room)
        residual = matrix @ solution - right
        # Of bends along one direction the next one turns, whichever are wrong.
        held = (along.needs.T & acts).any(axis=1) | always
        barred = (along.needs & ~acts | along.excludes & acts).any(axis=1)
        wrong = np.where(acts, (solution < -scale) & ~held, (residual < -scale) & ~barred)
        wrong &= behind == 0
        if not wrong.any():
            return True, rounds, np.zeros(0, dtype=int)
        first = int(np.argmax(wrong))
        turned.append(first)
        acts[first] = not acts[first]
        acts[:] = acts[master]
    return False, most, np.unique(turned)


def _share(
    matrix: np.ndarray,
    right: np.ndarray,
    always: np.ndarray,
    behind: np.ndarray,
    along: _Along,
    solution: np.ndarray,
    acts: np.ndarray,
    circle: np.ndarray,
) -> tuple[bool, int]:
    """Find what share of each master's riders is released: all below no tension, none above it.

    With shares given, what is left is a problem with a P-matrix whose solution goes continuously
    with them; so there are shares that agree with it. They are sought for the masters among the
    rows ``circle``; others keep all or nothing, as the set ``acts`` has it, unless their tension
    then disagrees. Fills the solution; returns whether shares were found, and the rounds of
    pivoting.
    """
    master, rides = np.arange(behind.size) - behind, behind > 0
    masters, size = np.unique(master[rides]), 1.0 + np.abs(right).max()
    shares, none, total, looks = np.where(acts, 1.0, 0.0), np.zeros_like(behind), 0, 0
    sought = np.isin(masters, circle)
    sought |= not sought.any()
    acts = always | (solution > 0.0)  # near what was right for the shares before

    def excess(of_masters: np.ndarray) -> np.ndarray:
        """Tension of masters where it is above zero, less their compensation where it is not."""
        nonlocal total, looks
        shares[masters[sought]] = of_masters
        part = np.where(rides, shares[master], 1.0)
        partly = matrix * part[:, None]
        partly[np.diag_indices(part.size)] += 1.0 - part
        free = always | (rides & (part > 0.0))
        acts[free], acts[rides & ~free] = True, False
        found, rounds, _ = _pivot(partly, right * part, free, none, along, solution, acts)
        total, looks = total + rounds, looks + 1
        left = (matrix[masters] @ solution - right[masters] - solution[masters]) / size
        return left if found and looks < _MOST_LOOKS else np.full(masters.size, np.nan)

    def beyond(place: np.ndarray) -> np.ndarray:
        """Zero where shares, a place cut to 0 to 1, agree with tensions, as far as it lies outside:
        the normal map of a variational inequality."""
        share = np.clip(place, 0.0, 1.0)
        return excess(share)[sought] + place - share

    while True:
        start = shares[masters[sought]]
        place, found = find_zero(beyond, start - excess(start)[sought], _FIRST_GRID, _AGREEMENT)
        left = excess(np.clip(place, 0.0, 1.0))
        all_or_nothing = np.where(shares[masters] > 0.0, left, -left)
        more = ~sought & ~(found & (all_or_nothing <= _AGREEMENT))
        if not more.any():
            return found, total
        sought |= more  # all of them, if there are no shares with the others as they are
        shares[masters] = np.clip(np.nan_to_num(shares[masters]), 0.0, 1.0)
