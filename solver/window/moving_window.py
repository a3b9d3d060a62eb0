"""A window of moving stations on a line whose steps are taken in two passes, on one rank."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from catenary.solver.kernels import native
from catenary.solver.linear.pieces import OperatorPieces, WantedPieces
from catenary.solver.linear.station_factors import StationFactors
from catenary.solver.model.loads import Load
from catenary.solver.model.model import Model
from catenary.solver.problem.problem import EXACT, Problem, WindowChoice
from catenary.solver.window.choice import why_no_window

# Numbers of the window's ``state``.
STEP, IS_FRESH = 0, 1


# Steps from one look to the next.
EVERY = 8
# Steps between which what is ahead may be made.
MOST_STEPS = 512
# Stations of the smallest window.
LEAST = native.LEAST_STATIONS
# Stations around a window whose rows the energy reads.
_AROUND = 192


class MovingWindow:
    """Window of the stations that move. Not collective.

    Attributes
    ----------
    arrays : ``native.Window``

    Parameters
    ----------
    choice : WindowChoice of a window that moves
    dt : time step [s]
    model : model of the line
    factors : factors of its step operator; the place where elimination ends may move
    contacts : (n,) places of the contacts [m]; kept by reference
    reach : distance that a force moves the line within a step [m]
    links : (m, k) unknowns of each link, in the order along the track
    moving_links : (2,) int, filled with the first link that may switch and the one after the last
    known : accelerations that the motion keeps besides x, y and z, or none
    operators : of a line in pieces, None if it is whole
    """

    def __init__(
        self,
        choice: WindowChoice,
        dt: float,
        model: Model,
        factors: StationFactors,
        contacts: np.ndarray,
        reach: float,
        links: np.ndarray,
        moving_links: np.ndarray,
        known: np.ndarray,
        operators: OperatorPieces | None = None,
    ) -> None:
        assert factors.turning is not None
        numbering = model.numbering
        low = np.ascontiguousarray(numbering.low)
        starts = np.asarray(numbering.starts, dtype=np.int64)
        n = low.size
        spacing = (low[-1] - low[0]) / max(1, n - 1)
        station = np.searchsorted(starts, links.min(axis=1, initial=starts[-1]), side="right") - 1
        before = np.searchsorted(np.maximum.accumulate(station), np.arange(n + 1))
        moving_links[:] = 0, len(links)
        self.arrays = native.Window(
            state=np.array([0, 1], dtype=np.int64),
            every=EVERY,
            guard=max(1, int(np.ceil(reach / spacing))),
            by_motion=choice.by_motion,
            spans_behind=choice.spans_behind,
            spans_ahead=choice.spans_ahead,
            fading=choice.fading * EVERY * dt,
            is_exact=choice.mode == EXACT,
            peak=np.zeros(2),
            contacts=contacts,
            loaded=_places_of(model, model.loads),
            # Links within reach of a contact may switch, and reach as far themselves.
            margin=2.0 * reach,
            masts=np.array(model.problem.line.support_positions, dtype=float),
            low=low,
            high=np.ascontiguousarray(numbering.high),
            starts=starts,
            links_before=before.astype(np.int64),
            ends=factors.arrays.ends,
            kinds=factors.arrays.kinds,
            turning=factors.turning,
            links=moving_links,
            ranges=np.zeros((2, 2), dtype=np.int64),
            known=known,
        )
        self.arrays.ranges[1, 1] = len(links)
        self._operators = operators
        # First station of the pieces that are there and the one after the last.
        self._covered = 0, 0

    def provide(self, way: float) -> None:
        """Have what steps need until contacts are a ``way`` [m] further, at most ``MOST_STEPS``.

        Raises
        ------
        RunBroken
            If the line cannot be factored there.
        """
        if self._operators is None:
            return
        arrays = self.arrays
        first, last = float(arrays.contacts.min()), float(arrays.contacts.max()) + way
        masts, n = arrays.masts, arrays.low.size
        spans, (behind, ahead) = self._spans_around(first, last)
        begin, end = 0, n
        if spans[0] > 0.0:
            begin = int(np.searchsorted(arrays.high, min(behind, first - arrays.margin)))
        if spans[1] < masts.size - 1:
            place = max(ahead, last + arrays.margin)
            end = int(np.searchsorted(arrays.low, place, side="right"))
        begin, end = max(0, min(begin, end - LEAST)), min(n, max(end, begin + LEAST))
        if not arrays.state[IS_FRESH]:
            begin, end = min(begin, int(arrays.ends[2])), max(end, int(arrays.ends[3]))
        self.provide_rows(max(0, begin - _AROUND), min(n, end + _AROUND))

    def _spans_around(self, first: float, last: float) -> tuple[np.ndarray, np.ndarray]:
        """Ends of a window of spans around contacts from ``first`` to ``last`` [m]: as numbers of
        spans, which may be beyond the line, and as places [m], (2,) each."""
        arrays = self.arrays
        masts, numbers = arrays.masts, np.arange(arrays.masts.size)
        spans = np.interp([first, last], masts, numbers)
        spans += -arrays.spans_behind, arrays.spans_ahead
        return spans, np.interp(spans, numbers, masts)

    def first_of_spans(self, contacts: np.ndarray) -> int:
        """First station of a window of spans around ``contacts`` (n,) [m], which moves and has not
        been left behind; 0 where the motion decides."""
        arrays = self.arrays
        if arrays.by_motion > 0.0:
            return 0
        last = float(contacts.min())
        spans, places = self._spans_around(last, last)
        if spans[0] <= 0.0:
            return 0
        behind = min(float(places[0]), float(arrays.loaded[0]))
        return int(np.searchsorted(arrays.high, behind))

    def provide_rows(self, begin: int, end: int) -> None:
        """Have products with the rows of stations from ``begin`` to before ``end``."""
        if self._operators is not None and not self.has_rows(begin, end):
            self._covered = self._operators.pieces.cover(begin, end)

    def has_rows(self, begin: int, end: int) -> bool:
        """Whether there are products with these rows."""
        first, last = self._covered
        return self._operators is None or (first <= begin and end <= last)

    @property
    def most_rows(self) -> int:
        """Stations that ``provide_rows`` may be asked for at once."""
        if self._operators is None:
            return int(self.arrays.low.size)
        pieces = self._operators.pieces
        return pieces.size * (pieces.n_slots - 1)

    @property
    def stations(self) -> tuple[np.ndarray, np.ndarray]:
        """The first station that moves and the one after the last, kept up to date, and first
        unknowns (n + 1,) of all stations."""
        return self.arrays.ends, self.arrays.starts

    def state(self) -> np.ndarray:
        """Steps taken, range of stations and largest motion, as numbers to go on from."""
        arrays = self.arrays
        return np.array([*arrays.state, *arrays.ends[2:4], *arrays.peak], dtype=float)

    def wake(self) -> None:
        """Open the window to all stations until the next look, as after a change of the motion."""
        arrays = self.arrays
        arrays.state[:] = 0, 1
        native.turn_to(arrays, 0, arrays.low.size)

    def restore(self, state: np.ndarray) -> None:
        """Go on from a ``state``."""
        arrays = self.arrays
        step, is_fresh, begin, end = state[:4].astype(np.int64).tolist()
        arrays.state[STEP], arrays.state[IS_FRESH] = step, is_fresh
        native.turn_to(arrays, begin, end)
        arrays.peak[:] = state[4:6]


def wanted_pieces(problem: Problem, model: Model, contacts: np.ndarray) -> WantedPieces | None:
    """Part of a line that steps with a window need at a time, None if it is not known beforehand.

    ``contacts`` (n,) are where they are [m]. Not collective.
    """
    window, masts = problem.window, np.array(problem.line.support_positions, dtype=float)
    if not window.moves or window.by_motion > 0.0 or why_no_window(problem) or model.loads:
        return None
    n_spans = math.ceil(window.spans_behind) + math.ceil(window.spans_ahead) + 2
    if n_spans >= masts.size:
        return None
    train = problem.train
    moving = float((masts[n_spans:] - masts[:-n_spans]).max() + np.ptp(contacts))
    ahead = MOST_STEPS * problem.numerics.dt * train.speed
    return WantedPieces(moving, ahead, 2 * _AROUND + LEAST)


def _places_of(model: Model, loads: Sequence[Load]) -> np.ndarray:
    """First and last place with a load [m]; none if there are no loads."""
    numbering, result = model.numbering, np.array([np.inf, -np.inf])
    for load in loads:
        if load.unknowns.size:
            station = np.searchsorted(numbering.starts, load.unknowns, side="right") - 1
            result[0] = min(result[0], numbering.low[station.min()])
            result[1] = max(result[1], numbering.high[station.max()])
    return result
