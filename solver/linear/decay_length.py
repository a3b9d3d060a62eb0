"""Reach of the response to a point load within one time step.

The step operator A = M + gamma dt C + beta dt^2 K is nearly a mass matrix: the columns of its
inverse decay exponentially along the track and vanish to round-off within about a span. The
parallel solver and the compliance table are both built on this length.
"""

from __future__ import annotations

import numpy as np

from catenary.solver.model.model import Model
from catenary.solver.model.operator_bands import OperatorBands
from catenary.solver.model.stations import SAME_STATION

# Beyond the reach a column is below this share of its peak; two orders under what an iteration
# over a whole run may add up to and still agree to 1e-9.
DECAY = 1e-16
# The probes look at two places of the line; spans differ, so take this much more.
_MARGIN = 1.25
# First distance of probes to either side [m], doubled whenever that is not enough.
_WINDOW = 200.0
# Share of a window within which columns must decay, so that its ends have no part in that.
_SEEN = 0.9
# Distance around the longest element in which loads are tried, about a span to either side [m].
_NEAR = 75.0


def reach(model: Model, bands: OperatorBands) -> float:
    """Distance along the track beyond which a column of A^-1 vanishes [m]. Not collective.

    ``bands`` are those of A. Solves with A on windows of the line, for loads
    in the middle and at the gaps' ends around the longest element: every element takes its share
    of the decay, so that this needs more way where elements are long. Windows grow until columns
    decay within them: bending waves within a span or two, waves along wires in 18 steps of their
    way. Returns the length of the line if a column does not decay on it.
    """
    positions = np.sort(model.mesh.points[:, 0])
    total = float(positions[-1] - positions[0])
    furthest = 0.0
    middle = 0.5 * float(positions[0] + positions[-1])
    in_the_middle = middle, positions[[np.argmin(np.abs(positions - middle))]]
    for place, loads in (in_the_middle, _around_the_longest(positions)):
        window = _WINDOW
        found, seen = _reach_of(loads, place, model, bands, positions, window)
        while found > _SEEN * seen:
            if window >= total:
                return total
            window *= 2.0
            found, seen = _reach_of(loads, place, model, bands, positions, window)
        furthest = max(furthest, found)
    return min(total, _MARGIN * furthest)


def _around_the_longest(positions: np.ndarray) -> tuple[float, np.ndarray]:
    """Place of the longest element [m], and stations near it at which element lengths change."""
    stations = positions[np.append(True, np.diff(positions) > SAME_STATION)]
    lengths = np.diff(stations)
    place = float(stations[np.argmax(lengths)])
    changes = np.abs(np.diff(lengths)) > 0.01 * lengths[1:]
    ends = stations[1:-1][changes]
    near = ends[np.abs(ends - place) <= _NEAR]
    return place, near if near.size else np.array([place])


def _reach_of(
    loads: np.ndarray,
    place: float,
    model: Model,
    bands: OperatorBands,
    positions: np.ndarray,
    window: float,
) -> tuple[float, float]:
    """Largest reach of loads at stations [m], and the least way that was looked at [m].

    The window lies around ``place``, ``window`` [m] to either side. At an end of the line only one
    side is there to be seen.
    """
    first, last = model.numbering.within(place - window, place + window)
    x = model.numbering.as_vector(model.mesh.points[:, :1], np.inf)[first:last]
    x[model.constrained_between(first, last) - first] = np.inf
    loaded = np.flatnonzero((np.abs(x[:, None] - loads) <= SAME_STATION).any(axis=1))
    right = np.zeros((loaded.size, last - first))
    right[np.arange(loaded.size), loaded] = 1.0
    columns = np.abs(bands.solve(first, last, right))
    big = columns > DECAY * columns.max(axis=1, keepdims=True)
    apart = np.where(big, np.abs(x - x[loaded, None]), 0.0)
    both = np.maximum(positions[-1] - loads, loads - positions[0])
    seen = np.minimum(window - np.abs(loads - place), both).min()
    return float(apart.max(initial=0.0)), float(seen)
