"""Answers of the line within one step to unit forces on wire and droppers: how far, and how much.

The step operator A = M + gamma dt C + beta dt^2 K is nearly a mass matrix: the columns of its
inverse decay exponentially along the track and vanish to round-off within about a span. The
parallel solver and the table of short columns are both built on this reach. Only a window of a
column is stored, and nothing beyond the reach has a part in it: a banded solve on a stretch of the
line gives all columns there. Columns at places with like surroundings are the same, and are stored
once.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from catenary.base.errors import RunBroken
from catenary.base.mpi import MPI
from catenary.meshgen.wires import SAME_PLACE
from catenary.solver.linear.station_rows import LikeStations
from catenary.solver.model.alike import kinds_of
from catenary.solver.model.matrices import OperatorBands
from catenary.solver.model.model import Model
from catenary.solver.model.partition import Ownership
from catenary.solver.model.unknowns import Unknowns

# Beyond the reach a column is below this share of its peak; two orders under what an iteration
# over a whole run may add up to and still agree to 1e-9.
DECAY = 1e-16
# The probes look at two places of the line; spans differ, so take this much more.
_SPANS_DIFFER = 1.25
# First distance of probes to either side [m], doubled whenever that is not enough.
_WINDOW = 200.0
# Share of a window within which columns must decay, so that its ends have no part in that.
_SEEN_OF_WINDOW = 0.9
# Distance around the longest element in which loads are tried, about a span to either side [m].
_NEAR = 75.0
# Allowed part outside the windows, relative to the peak: round-off of one solve.
_LEAK = 1e-13
# Margin of a stretch beyond windows, of the reach, which shows whether columns leak.
_SEEN = 0.25
# Length of the places that are solved for on one stretch [m]: about a span.
STRETCH = 60.0
# With windows wider than this to both sides [m], as along the track with much damping, some of the
# columns are looked at first: what forces on heights are felt at is mostly narrower.
_LONG = 100.0
_PROBES = 12
# Allowed part outside of windows that are made narrower, and how much wider they are than seen.
# A column that is cut there acts like a force of this share beside its own: 1e-10 N.
_FELT, _MARGIN = 1e-12, 1.1
# Allowed part outside of windows that cannot be made wider any more: a force of 1e-7 N beside its
# own. Columns fade with the way, so that this bears them half as wide again as those tried.
FELT_AT_MOST = 1e-9
# No answer is as small, but for one to no force.
_TINY = np.finfo(float).tiny
# By how much the reach of windows grows where some column is felt further.
_MORE = 1.5


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
        while found > _SEEN_OF_WINDOW * seen:
            if window >= total:
                return total
            window *= 2.0
            found, seen = _reach_of(loads, place, model, bands, positions, window)
        furthest = max(furthest, found)
    return min(total, _SPANS_DIFFER * furthest)


def _around_the_longest(positions: np.ndarray) -> tuple[float, np.ndarray]:
    """Place of the longest element [m], and stations near it at which element lengths change."""
    stations = positions[np.append(True, np.diff(positions) > SAME_PLACE)]
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
    loaded = np.flatnonzero((np.abs(x[:, None] - loads) <= SAME_PLACE).any(axis=1))
    right = np.zeros((loaded.size, last - first))
    right[np.arange(loaded.size), loaded] = 1.0
    columns = np.abs(bands.solve(first, last, right))
    big = columns > DECAY * columns.max(axis=1, keepdims=True)
    apart = np.where(big, np.abs(x - x[loaded, None]), 0.0)
    both = np.maximum(positions[-1] - loads, loads - positions[0])
    seen = np.minimum(window - np.abs(loads - place), both).min()
    return float(apart.max(initial=0.0)), float(seen)


class FeltFurther(RunBroken):
    """A column reaches further than all columns that were tried; raised on all ranks."""


class Windows(NamedTuple):
    """Windows of unknowns that a force at x can move.

    Attributes
    ----------
    numbering : Unknowns, which says where they stand
    reach : half width of a window [m]
    """

    numbering: Unknowns
    reach: float

    def around(self, x_low: float, x_high: float) -> tuple[int, int]:
        """Range of unknowns within reach of [x_low, x_high]."""
        return self.numbering.within(x_low - self.reach, x_high + self.reach)

    @property
    def n_stations(self) -> int:
        """Number of stations within a reach, on the average of the line; at least one."""
        low = self.numbering.low
        spacing = (low[-1] - low[0]) / max(1, low.size - 1)
        return max(1, int(np.ceil(self.reach / spacing))) if spacing > 0.0 else low.size


class ShortColumns(NamedTuple):
    """Owned parts of columns of A^-1, of each of n places one or several, one after the other.

    Column k of place i is ``data[at[i] + k width[i] :][: width[i]]`` for the local unknowns from
    ``start[i]`` on. Places with like columns share them.

    Attributes
    ----------
    start, at, width : (n,) int
    data : numbers of all columns in a row
    reach : of their windows [m]
    """

    start: np.ndarray
    at: np.ndarray
    width: np.ndarray
    data: np.ndarray
    reach: float


NO_COLUMNS = ShortColumns(*(np.zeros(0, dtype=np.int64),) * 3, np.zeros(0), 0.0)


class Forces(NamedTuple):
    """Unit forces on a line, k at each of n places.

    Attributes
    ----------
    dofs, weights : (n, k, m) unknowns of each, and weights on these
    x : (n,) places [m]
    half : (n,) reach of the unknowns of a place to both sides of it [m]
    """

    dofs: np.ndarray
    weights: np.ndarray
    x: np.ndarray
    half: np.ndarray


class UnitResponses:
    """Answers of a line's step operator A to unit forces. Not collective but for ``columns``.

    Attributes
    ----------
    windows : Windows, whose reach is that of A^-1

    Parameters
    ----------
    comm : mpi4py communicator
    model, ownership : of the line
    bands : of A
    like : marks of the line's stations, found where needed if not given
    """

    def __init__(
        self,
        comm: Any,
        model: Model,
        ownership: Ownership,
        bands: OperatorBands,
        windows: Windows,
        like: LikeStations | None = None,
    ) -> None:
        self._like, self._bands = like, bands
        self._comm, self._model, self._ownership = comm, model, ownership
        self.windows = windows

    def columns(self, forces: Forces) -> ShortColumns:
        """Columns for unit forces. Collective.

        Raises
        ------
        RunBroken
            On all ranks, if a column does not vanish outside of its window.
        """
        places, reach = self.places(forces)
        like = LikeStations(self._model) if self._like is None else self._like
        while True:
            try:
                at, data = self.solve(places, like, reach)
                return ShortColumns(places.begin, at, places.width, data, reach)
            except FeltFurther:
                # Some of the columns were tried for the reach.
                reach = min(self.windows.reach, _MORE * reach)
                windows = self.windows._replace(reach=reach)
                places = Places.of(windows, self._ownership, forces)

    def places(self, forces: Forces) -> tuple[Places, float]:
        """Places of the columns for forces, and the reach of their windows [m]. Collective."""
        windows = self.windows
        if windows.reach > _LONG and forces.x.size:
            windows = windows._replace(reach=self._felt(forces))
        return Places.of(windows, self._ownership, forces), windows.reach

    def solve(
        self, places: Places, like: LikeStations, reach: float, felt: float = _FELT
    ) -> tuple[np.ndarray, np.ndarray]:
        """Starts of the columns of ``places``, and their numbers, as ``ShortColumns`` has them.

        Collective; ``like`` are marks of all stations that the windows of these reach, which is
        ``reach`` [m]. Raises as ``columns``, and FeltFurther where windows are narrower than the
        reach of A^-1 and more than ``felt`` of a column stands outside.
        """
        chosen, kinds = self._kinds(places, like)
        size = places.width[chosen] * places.dofs.shape[1]
        at = np.concatenate([np.zeros(1, np.int64), np.cumsum(size)])
        data = np.zeros(at[-1])
        leak, further = 0.0, (1.0 + _SEEN) * self.windows.reach
        end = float((places.x[chosen] + places.half[chosen]).max(initial=-np.inf)) + further
        _, furthest = self.windows.numbering.within(-np.inf, end)
        for stretch in _stretches(places.x, chosen):
            leak = max(leak, self._fill(places, chosen[stretch], at[stretch], data, furthest))
        allowed = _LEAK if reach >= self.windows.reach else felt
        if self._comm.allreduce(leak, op=MPI.MAX) > allowed:
            kind = RunBroken if reach >= self.windows.reach else FeltFurther
            raise kind(
                f"the response to a point load does not decay within {reach:.0f} m; give the scene "
                "a smaller numerics.dt_s"
            )
        return at[kinds], data

    def _felt(self, forces: Forces) -> float:
        """Distance at which some of the columns fall to round-off [m], with a margin; the same on
        all ranks."""
        numbering, furthest, (dofs, weights, x, half) = self.windows.numbering, 0.0, forces
        for place in np.unique(np.linspace(0, x.size - 1, _PROBES).astype(int)):
            near, to_side = slice(place, place + 1), half[place] + self.windows.reach
            first, last = numbering.within(x[place] - to_side, x[place] + to_side)
            answers = np.abs(self._answers(dofs[near], weights[near], first, last))
            felt = (answers > _FELT * answers.max(axis=1, keepdims=True)).any(axis=0)
            if not felt.any():
                continue
            ends = first + np.flatnonzero(felt)[[0, -1]]
            begin, end = np.searchsorted(numbering.starts, ends, side="right") - 1
            ways = x[place] - numbering.low[begin], numbering.high[end] - x[place]
            furthest = max(furthest, *(float(way) - half[place] for way in ways))
        return min(self.windows.reach, _MARGIN * furthest)

    def _answers(
        self, dofs: np.ndarray, weights: np.ndarray, first: int, last: int, further: int = 0
    ) -> np.ndarray:
        """Answers (n k, m) of the unknowns from ``first`` to before ``last``, alone, to forces with
        ``weights`` on ``dofs``, both (n, k, m'); those to before ``further`` come next."""
        n, each = dofs.shape[:2]
        right = np.zeros((n * each, last - first))
        column = np.repeat(np.arange(n * each), dofs.shape[2])
        np.add.at(right, (column, dofs.ravel() - first), weights.ravel())
        return np.ascontiguousarray(self._bands.solve(first, last, right, further))

    def _kinds(self, places: Places, like: LikeStations) -> tuple[np.ndarray, np.ndarray]:
        """Numbers of the places with own columns, and for each place the one that it shares."""
        starts = self.windows.numbering.starts
        marks = like.fingerprints(places.first, places.last)
        low, n = starts[places.first], places.x.size
        rows = [
            marks >> np.uint64(32),
            marks & np.uint64(2**32 - 1),
            places.begin + self._ownership.first - low,
            places.width,
            *(places.dofs.reshape(n, -1) - low[:, None]).T,
            *places.weights.reshape(n, -1).T,
        ]
        return kinds_of(np.stack([row.astype(float) for row in rows], axis=1))

    def _fill(
        self,
        places: Places,
        chosen: np.ndarray,
        at: np.ndarray,
        data: np.ndarray,
        further: int,
    ) -> float:
        """Fill in the columns of ``chosen`` places; how much of one is outside of its window,
        relative to its peak. Columns to before unknown ``further`` come next."""
        owned = chosen[places.width[chosen] > 0]
        if not owned.size:
            return 0.0
        numbering, more = self.windows.numbering, (1.0 + _SEEN) * self.windows.reach
        half = float(places.half[owned].max())
        first, last = numbering.within(
            float(places.x[owned].min()) - half - more, float(places.x[owned].max()) + half + more
        )
        dofs, weights = places.dofs[owned], places.weights[owned]
        answers = self._answers(dofs, weights, first, last, further)
        begin = places.begin[owned] + self._ownership.first - first
        low, high = (numbering.starts[station[owned]] for station in (places.first, places.last))
        n_forces, width = dofs.shape[1], places.width[owned]
        column = np.arange(answers.shape[1])

        def within(start: np.ndarray, end: np.ndarray) -> np.ndarray:
            """Columns of answers between two of each place."""
            first, last = (np.repeat(one, n_forces)[:, None] for one in (start, end))
            return (column >= first) & (column < last)

        sizes = n_forces * width
        to = at[places.width[chosen] > 0] - np.cumsum(sizes) + sizes
        values = answers[within(begin, begin + width)]
        data[np.repeat(to, sizes) + np.arange(values.size)] = values
        beyond = np.abs(answers)
        peak = np.maximum(beyond.max(axis=1), _TINY)
        beyond[within(low - first, high - first)] = 0.0
        return float((beyond.max(axis=1) / peak).max())


class Places(NamedTuple):
    """Places at which columns are wanted, their ``Forces``, and their windows.

    ``first`` and ``last`` (n,) are stations of the windows; ``begin`` and ``width`` (n,) the local
    unknowns in them that this rank owns.
    """

    dofs: np.ndarray
    weights: np.ndarray
    x: np.ndarray
    half: np.ndarray
    first: np.ndarray
    last: np.ndarray
    begin: np.ndarray
    width: np.ndarray

    @classmethod
    def of(cls, windows: Windows, ownership: Ownership, forces: Forces) -> Places:
        numbering, to_side = windows.numbering, forces.half + windows.reach
        first, last = numbering.stations_within(forces.x - to_side, forces.x + to_side)
        low, high = (
            np.clip(numbering.starts[station], ownership.first, ownership.last)
            for station in (first, last)
        )
        return cls(*forces, first, last, low - ownership.first, high - low)


def _stretches(x: np.ndarray, chosen: np.ndarray) -> list[np.ndarray]:
    """Numbers of the ``chosen`` places by stretches of the line, each of them short."""
    order = np.argsort(x[chosen], kind="stable")
    at = x[chosen][order]
    ends = [0]
    while ends[-1] < at.size:
        ends.append(int(np.searchsorted(at, at[ends[-1]] + STRETCH, side="right")))
    return [order[begin:end] for begin, end in zip(ends[:-1], ends[1:], strict=True)]
