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
    if operators is None:
        columns = responses.columns(*places)
        made(columns, np.arange(columns.start.size))
        return columns
    found, reach = responses.places(*places)
    x, pieces = found.x, operators.pieces
    # Places in their order along the track, and which of them are before each piece.
    order = np.argsort(x, kind="stable")
    edges = responses.windows.numbering.low[pieces.edges[1:-1]]
    ends = np.concatenate([[0], np.searchsorted(x[order], edges), [x.size]])
    sizes = np.cumsum(np.append(0, found.dofs.shape[1] * found.width[order]))
    room = int(np.diff(sizes[ends]).max(initial=0))
    at, data = np.zeros(x.size, dtype=np.int64), np.zeros(pieces.n_slots * room)
    columns = ShortColumns(found.begin, at, found.width, data, reach)

    def make(piece: Piece) -> None:
        number = piece.begin // pieces.size
        which = order[ends[number] : ends[number + 1]]
        if not which.size:
            return
        own = Places(*(part[which] for part in found))
        try:
            # Room and reach are those of all pieces.
            begins, numbers = responses.solve(own, operators.like, reach, FELT_AT_MOST)
        except FeltFurther as error:
            raise RunBroken(
                f"near {own.x.mean():.0f} m a force moves the line beyond the {reach:.0f} m that "
                "it reaches at the start, which a window cannot follow; set window.mode to off"
            ) from error
        first = piece.slot * room
        at[which] = first + begins
        data[first : first + numbers.size] = numbers
        made(columns, which)

    pieces.add(make)
    return columns
