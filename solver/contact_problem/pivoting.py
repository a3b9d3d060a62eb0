"""What finds a step's forces where the active set cycles: pivoting, and riders that carry in part.

Contacts and links alone are a linear complementarity problem with a P-matrix, which pivoting
solves. Riders are none: what a dropper does across it is whole while it is taut and nothing while
it is slack, whatever its tension, so that it jumps where that passes zero. If the jump tightens the
dropper that slackens, it is neither taut nor slack. The step then ends with its tension at zero and
riders that carry in part (docs/theory.md, section 16).
"""

from __future__ import annotations

import numpy as np
from scipy import optimize

from catenary.solver.base.errors import NotConverged
from catenary.solver.contact_problem import complementarity_kernels

# Masters are gone over by turns; they feel each other's riders by way of their lean alone.
_TURNS = 50
# What may be missing in a row, of the largest right-hand side.
_ROUNDING = 1e-12


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
    found, rounds = _pivot(matrix, right, always, behind, solution)
    if not found and behind.any():
        found, more = _share(matrix, right, always, behind, solution)
        rounds += more
    if not found:
        raise NotConverged(
            "contacts and slack droppers of this step have no common solution; take a smaller "
            "numerics.dt_s or less contact damping"
        )
    return rounds


def _pivot(
    matrix: np.ndarray,
    right: np.ndarray,
    always: np.ndarray,
    behind: np.ndarray,
    solution: np.ndarray,
) -> tuple[bool, int]:
    """Whether a set was right, and the rounds to get there."""
    acts, master = always.copy(), np.arange(behind.size) - behind
    scale = _ROUNDING * (1.0 + np.abs(right).max())
    most = 20 * right.size + 100
    for rounds in range(1, most):
        complementarity_kernels.solve_on(matrix, right, acts, solution)
        residual = matrix @ solution - right
        wrong = np.where(acts, (solution < -scale) & ~always, residual < -scale)
        wrong &= behind == 0
        if not wrong.any():
            return True, rounds
        first = int(np.argmax(wrong))
        acts[first] = not acts[first]
        acts = acts[master]
    return False, most


def _share(
    matrix: np.ndarray,
    right: np.ndarray,
    always: np.ndarray,
    behind: np.ndarray,
    solution: np.ndarray,
) -> tuple[bool, int]:
    """Find what share of each master's riders is released: all below no tension, none above it.

    With shares given, what is left is a problem with a P-matrix whose solution goes continuously
    with them; so there are shares that agree with it. Fills the solution; returns whether shares
    were found, and the rounds of pivoting.
    """
    master, rides = np.arange(behind.size) - behind, behind > 0
    shares, none, total = np.zeros(behind.size), np.zeros_like(behind), 0

    def excess(one: int, share: float) -> float:
        """Tension of a master where it is above zero, less its compensation where it is not."""
        nonlocal total
        shares[one] = share
        part = np.where(rides, shares[master], 1.0)
        partly = matrix * part[:, None]
        partly[np.diag_indices(part.size)] += 1.0 - part
        found, rounds = _pivot(partly, right * part, always | rides, none, solution)
        total += rounds
        return float(matrix[one] @ solution - right[one] - solution[one]) if found else np.nan

    def agrees(one: int) -> bool:
        """Whether the share of a master goes with its tension; False where there is none."""
        share, left = shares[one], excess(one, shares[one])
        return bool((left >= -scale or share == 1.0) and (left <= scale or share == 0.0))

    scale = _ROUNDING * (1.0 + np.abs(right).max())
    for _ in range(_TURNS):
        settled = True
        for one in np.unique(master[rides]):
            if agrees(one):
                continue
            settled = False
            taut, slack = excess(one, 0.0), excess(one, 1.0)
            if np.isnan(taut + slack):
                return False, total
            shares[one] = float(taut < 0.0)
            if taut < 0.0 < slack:
                shares[one] = optimize.brentq(lambda at, one=one: excess(one, at), 0.0, 1.0)
        if settled:
            return True, total
    return False, total
