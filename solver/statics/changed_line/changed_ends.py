"""Ends of a line that goes on, once something has changed all along it: wind, a tension, wear.

The line beyond is as the last span, so that it changes as well. Its stiffness at the end, which K
has, stands for one that does not. Where loads have changed in the last span, the end therefore
moves as the masts before it do, in height as the last one, sideways as the one before that (of a
zig-zag every second span is a mirror image), which is found by turns. Where they have not, as by a
dropper that is missing spans away, the end is left to that stiffness, which is exact.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from catenary.solver.model.model import Model
from catenary.solver.model.stations import SAME_STATION
from catenary.solver.problem.ends import Fixed
from catenary.solver.problem.problem import Problem
from catenary.solver.statics.repeated_ends import repeated_ends

# Loads that are nothing, over the largest: round-off of droppers of 1e6 N/m.
_NOTHING = 1e-6
# Change of ends from turn to turn that are settled [m], and one that is round-off of rests which
# Newton's method finds to 1e-9 m, if it falls no more.
_SETTLED, _ROUND_OFF = 1e-12, 1e-8
# Unknowns of each plane, and which mast before the end moves as it does: 0 is the last one.
_FOLLOWED = {"w": 0, "theta_y": 0, "v": 1, "theta_z": 1}


class EndsThatFollow(NamedTuple):
    """Unknowns at ends of a line that move as those of masts before them do.

    Attributes
    ----------
    ends : (k,) numbers of the unknowns at ends; none if no end follows
    masts : (k,) numbers of those that they follow
    sides : whether the start of the line and its end follow
    """

    ends: np.ndarray
    masts: np.ndarray
    sides: tuple[bool, bool] = (False, False)

    def held(self, problem: Problem) -> Problem:
        """A problem whose ends that follow are held: none is as a line beyond needs it, of spans
        alike, before all have settled."""
        ends = zip(self.sides, problem.ends, strict=True)
        start, end = (Fixed() if follows else own for follows, own in ends)
        return replace(problem, ends=(start, end))

    def has_settled(self, change: float, before: float) -> bool:
        """Whether a ``change`` from turn to turn ends them, after one that was ``before`` [m]."""
        return change < _SETTLED or before <= change < _ROUND_OFF


NO_ENDS = EndsThatFollow(np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64))


def ends_that_follow(model: Model, loads: np.ndarray) -> EndsThatFollow:
    """Ends of a line that goes on which move with their masts, under changed loads (n_dofs,).

    Not collective.
    """
    repeated = repeated_ends(model)
    x, masts = model.mesh.points[:, 0], model.problem.line.support_positions
    largest = float(np.abs(loads).max(initial=0.0))
    sides, pairs = [False, False], [np.zeros((0, 2), dtype=np.int64)]
    for side, (end, mast) in enumerate((masts[:2], masts[:-3:-1])):
        at = np.abs(x[repeated.ends] - end) < SAME_STATION
        low, high = sorted((float(end), float(mast)))
        within = np.flatnonzero((x > low + SAME_STATION) & (x < high - SAME_STATION))
        on_span = np.abs(loads[_dofs(model, within)]).max(initial=0.0)
        if not at.any() or on_span <= _NOTHING * largest:
            continue
        sides[side] = True
        for name, number in _FOLLOWED.items():
            if name in model.unknowns:
                nodes = repeated.ends[at], repeated.masts[number][at]
                pairs.append(np.stack([model.dofs(one, name) for one in nodes], axis=1))
    # Wires that move together share unknowns.
    found = np.unique(np.concatenate(pairs), axis=0)
    ends, followed = found[~np.isin(found[:, 0], model.constrained)].T
    return EndsThatFollow(ends, followed, (sides[0], sides[1]))


def _dofs(model: Model, nodes: np.ndarray) -> np.ndarray:
    """Numbers of all unknowns of nodes in any plane."""
    names = [name for name in _FOLLOWED if name in model.unknowns]
    return np.concatenate([model.dofs(nodes, name) for name in names])
