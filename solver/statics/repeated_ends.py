"""Ends of a line that goes on beyond: they hang, and move, as the same wires do a span before.

At an end the cross-section stands as high above the track and slopes as at the mast before it; in
the lateral plane it slopes as two masts before, since every second span of a zig-zag is a mirror
image. Form finding looks for that by turns: what an end does to a mast before it falls by a factor
of a hundred and more a span, so that a few turns settle it to round-off.

The line beyond is as the last span, so that it changes as well once something has changed all along
the line: wind, a tension, wear. Its stiffness at the end, which K has, stands for one that does
not. Where loads have changed in the last span, the end therefore moves as the masts before it do,
in height as the last one, sideways as the one before that, which is found by turns. Where they have
not, as by a dropper that is missing spans away, the end is left to that stiffness, which is exact.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from catenary.base.errors import InputError
from catenary.meshgen.wires import SAME_PLACE
from catenary.solver.model.model import Model
from catenary.solver.problem.ends import Fixed
from catenary.solver.problem.problem import Problem


class Changes(NamedTuple):
    """Changes from turn to turn by which a line is judged.

    Attributes
    ----------
    none : of one that is settled [m]
    round_off : of one that is settled if they fall no more [m]
    relative : whether both grow with the largest value above 1 m, as its round-off does
    """

    none: float
    round_off: float
    relative: bool


# Slack lines have a rest that is found less exactly.
_OF_PLANE = Changes(1e-14, 1e-11, relative=True)
# Rests which Newton's method finds to 1e-9 m, wherever they are.
OF_REST = Changes(1e-12, 1e-8, relative=False)
# Turns at most.
_MOST_TURNS = 40
# Loads that are nothing, over the largest: round-off of droppers of 1e6 N/m.
_NOTHING = 1e-6
# Unknowns of each plane, and which mast before the end moves as it does: 0 is the last one.
_FOLLOWED = {"w": 0, "theta_y": 0, "v": 1, "theta_z": 1}


class RepeatedEnds(NamedTuple):
    """Nodes where wires end with a line that goes on.

    Attributes
    ----------
    ends : (k,) the nodes
    masts : (2, k) those of the same wires at the mast before, and at the one before that
    rise : (k,) from the mast before to the end, of the wires as they are given [m]
    """

    ends: np.ndarray
    masts: np.ndarray
    rise: np.ndarray


def repeated_ends(model: Model) -> RepeatedEnds:
    """Ends of wires of a model's line that goes on; none if it does not."""
    line = model.problem.line
    places, found, rise = line.support_positions, [], []
    for goes_on, at in zip(model.simulated.goes_on, ((0, 1, 2), (-1, -2, -3)), strict=True):
        for wire in line.wires if goes_on else ():
            nodes = [_node_at(model, wire.name, places[mast]) for mast in at]
            if min(nodes) >= 0 and nodes[0] in model.mesh.anchors:
                end, before = wire.points(places[list(at[:2])])[:, 2]
                found.append(nodes)
                rise.append(end - before)
    numbers = np.reshape(np.array(found, dtype=np.int64), (-1, 3)).T
    return RepeatedEnds(numbers[0], numbers[1:], np.array(rise, dtype=float))


def _node_at(model: Model, wire: str, x: float) -> int:
    """The node of a wire at a place [m], -1 if there is none."""
    nodes = model.mesh.wires[wire]
    at = np.flatnonzero(np.abs(model.mesh.x(nodes) - x) < SAME_PLACE)
    return int(nodes[at[0]]) if at.size else -1


def settled(
    turn: Callable[[np.ndarray], np.ndarray],
    first: np.ndarray,
    changes: Changes = _OF_PLANE,
) -> np.ndarray:
    """The values that a ``turn`` returns as they are, from ``first`` ones. Not collective.

    Raises
    ------
    InputError
        If they do not settle.
    """
    values, before = first, np.inf
    for _ in range(_MOST_TURNS):
        found = turn(values)
        change = np.abs(found - values).max(initial=0.0)
        values = found
        scale = max(1.0, float(np.abs(values).max(initial=0.0))) if changes.relative else 1.0
        if change < changes.none * scale or before <= change < changes.round_off * scale:
            return values
        before = change
    raise InputError(
        "the line at rest does not settle where line.ends says that it is periodic: its end still "
        f"moves by {1e3 * change:.2g} mm when it hangs as the span before does; end it otherwise"
    )


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


NO_ENDS = EndsThatFollow(np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64))


def ends_that_follow(model: Model, loads: np.ndarray) -> EndsThatFollow:
    """Ends of a line that goes on which move with their masts, under changed loads (n_dofs,).

    Not collective.
    """
    repeated = repeated_ends(model)
    x, masts = model.mesh.points[:, 0], model.problem.line.support_positions
    largest = float(np.abs(loads).max(initial=0.0))
    sides, pairs = [False, False], [np.zeros((0, 2), dtype=np.int64)]
    followed = {name: mast for name, mast in _FOLLOWED.items() if name in model.unknowns}
    for side, (end, mast) in enumerate((masts[:2], masts[:-3:-1])):
        at = np.abs(x[repeated.ends] - end) < SAME_PLACE
        low, high = sorted((float(end), float(mast)))
        within = np.flatnonzero((x > low + SAME_PLACE) & (x < high - SAME_PLACE))
        inner = np.concatenate([model.dofs(within, name) for name in followed])
        on_span = np.abs(loads[inner]).max(initial=0.0)
        if not at.any() or on_span <= _NOTHING * largest:
            continue
        sides[side] = True
        for name, number in followed.items():
            nodes = repeated.ends[at], repeated.masts[number][at]
            pairs.append(np.stack([model.dofs(one, name) for one in nodes], axis=1))
    # Wires that move together share unknowns.
    found = np.unique(np.concatenate(pairs), axis=0)
    ends, leading = found[~np.isin(found[:, 0], model.constrained)].T
    return EndsThatFollow(ends, leading, (sides[0], sides[1]))
