"""Ends of a line that goes on beyond: at rest they hang as the same wires do a span before.

There the cross-section stands as high above the track and slopes as at the mast before it; in the
lateral plane it slopes as two masts before, since every second span of a zig-zag is a mirror image.
Form finding looks for that by turns: what an end does to a mast before it falls by a factor of a
hundred and more a span, so that a few turns settle it to round-off.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from catenary.base.errors import InputError
from catenary.solver.model.model import Model
from catenary.solver.model.stations import SAME_STATION

# Change from turn to turn of a line that is settled [m]; one that is round-off of its rest if it
# falls no more, as of slack lines whose rest is found less exactly; and the most turns.
_SETTLED, _ROUND_OFF, _MOST_TURNS = 1e-14, 1e-11, 40


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
    at = np.flatnonzero(np.abs(model.mesh.x(nodes) - x) < SAME_STATION)
    return int(nodes[at[0]]) if at.size else -1


def settled(turn: Callable[[np.ndarray], np.ndarray], first: np.ndarray) -> np.ndarray:
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
        scale = max(1.0, float(np.abs(values).max(initial=0.0)))
        if change < _SETTLED * scale or before <= change < _ROUND_OFF * scale:
            return values
        before = change
    raise InputError(
        "the line at rest does not settle where line.ends says that it is periodic: its end still "
        f"moves by {1e3 * change:.2g} mm when it hangs as the span before does; end it otherwise"
    )
