"""Short columns of A^-1 of the places in those pieces of a line that a window needs."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from catenary.base.errors import RunBroken
from catenary.solver.linear.pieces.operator_pieces import OperatorPieces
from catenary.solver.linear.pieces.pieces import Piece
from catenary.solver.linear.unit_responses import (
    FELT_AT_MOST,
    FeltFurther,
    Places,
    ShortColumns,
    UnitResponses,
)

Made = Callable[[ShortColumns, np.ndarray], None]


def columns_of(
    responses: UnitResponses,
    operators: OperatorPieces | None,
    places: tuple[np.ndarray, ...],
    made: Made,
) -> ShortColumns:
    """Columns as ``UnitResponses.columns`` makes them: all at once, or by the pieces that there
    are. Collective.

    Parameters
    ----------
    responses : UnitResponses
        Solver of columns.
    operators : OperatorPieces or None
        Operators of the pieces, None if the line is whole.
    places : tuple of ndarray
        Arguments of ``UnitResponses.columns``.
    made : Made
        Function that is called with all columns and the numbers of the places that have
        theirs now.
    """
    if operators is not None:
        return ColumnPieces(responses, operators, places, made).columns
    columns = responses.columns(*places)
    made(columns, np.arange(columns.start.size))
    return columns


class ColumnPieces:
    """Columns of a table of places, made by pieces. Not collective.

    Attributes
    ----------
    columns : ShortColumns, whose arrays are filled in place

    Parameters
    ----------
    responses : solver for columns
    operators : of the line, whose pieces these are
    places, made : as of ``columns_of``
    """

    def __init__(
        self,
        responses: UnitResponses,
        operators: OperatorPieces,
        places: tuple[np.ndarray, ...],
        made: Made,
    ) -> None:
        self._responses, self._operators, self._made = responses, operators, made
        self._places, reach = responses.places(*places)
        x, n_forces = self._places.x, self._places.dofs.shape[1]
        pieces, low = operators.pieces, responses.windows.numbering.low
        # Places in their order along the track, and which of them are before each piece.
        self._order = np.argsort(x, kind="stable")
        ends = np.searchsorted(x[self._order], low[pieces.edges[1:-1]])
        self._ends = np.concatenate([[0], ends, [x.size]])
        sizes = np.cumsum(np.append(0, n_forces * self._places.width[self._order]))
        self._room = int(np.diff(sizes[self._ends]).max(initial=0))
        self._size = pieces.size
        at, data = np.zeros(x.size, dtype=np.int64), np.zeros(pieces.n_slots * self._room)
        self.columns = ShortColumns(self._places.begin, at, self._places.width, data, reach)
        pieces.add(self._make)

    def _make(self, piece: Piece) -> None:
        number = piece.begin // self._size
        which = self._order[self._ends[number] : self._ends[number + 1]]
        if not which.size:
            return
        columns, first = self.columns, piece.slot * self._room
        like = self._operators.like
        places = Places(*(part[which] for part in self._places))
        try:
            # Room and reach are those of all pieces.
            at, data = self._responses.solve(places, like, columns.reach, FELT_AT_MOST)
        except FeltFurther as error:
            raise RunBroken(
                f"near {places.x.mean():.0f} m a force moves the line beyond the "
                f"{columns.reach:.0f} m that it reaches at the start, which a window cannot "
                "follow; set window.mode to off"
            ) from error
        columns.at[which] = first + at
        columns.data[first : first + data.size] = data
        self._made(columns, which)
