"""Where the wires of a line are cut, and the points of each wire there. No mesh yet."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from catenary.base.errors import InputError
from catenary.meshgen.hardware import Droppers
from catenary.meshgen.line import Line
from catenary.meshgen.wires import End

# Places closer than this along the track are one cut [m].
SAME_CUT = 1e-6


@dataclass(frozen=True)
class PieceCuts:
    """A piece of wire as cut.

    Attributes
    ----------
    wire : name
    first : number of its first cut; it is cut at all that follow, up to its last one
    points : (n, 3) points before form finding [m]
    ends : (2,) bool, whether its first and its last point are held
    """

    wire: str
    first: int
    points: np.ndarray
    ends: tuple[bool, bool]


@dataclass(frozen=True)
class Cuts:
    """Every place at which the wires are cut, in order of x.

    Attributes
    ----------
    x : (n,) [m]
    is_mast : (n,) bool, whether a mast stands there, both anchors included
    pieces : of all wires, in the order of the line's wires
    """

    x: np.ndarray
    is_mast: np.ndarray
    pieces: tuple[PieceCuts, ...]

    def of(self, x: np.ndarray) -> np.ndarray:
        """Numbers of the cuts at positions ``x`` (n,) [m]."""
        return np.searchsorted(self.x, np.asarray(x, dtype=float) - SAME_CUT)


def find_cuts(line: Line) -> Cuts:
    """Masts, ends of wires and of droppers, with all wires cut at each of them. Not collective.

    Wires that are cut at the same places have their nodes beside each other: the matrices then
    join stations along the track to their neighbours only.

    Raises
    ------
    InputError
        If the upper wire of a dropper does not pass above its lower end.
    """
    masts = line.support_positions
    ends = [x for wire in line.wires for piece in wire.pieces for x in (piece.x[0], piece.x[-1])]
    places = [masts, np.array(ends)]
    places += [np.array(x) for group in line.droppers for x in (group.upper_x, group.lower_x)]
    places += [np.array(group.x) for group in (*line.hardware, *line.clamps)]
    x = np.concatenate(places)
    # Sorting is stable: of places that are one, a mast stays.
    x = x[np.argsort(x, kind="stable")]
    x = x[np.diff(x, prepend=-np.inf) > SAME_CUT]
    is_mast = np.zeros(x.size, dtype=bool)
    is_mast[np.searchsorted(x, masts - SAME_CUT)] = True
    pieces = []
    for wire in line.wires:
        for piece in wire.pieces:
            first, last = np.searchsorted(x, np.array([piece.x[0], piece.x[-1]]) - SAME_CUT)
            points = wire.points(x[first : last + 1])
            held = piece.ends[0] is End.HELD, piece.ends[1] is End.HELD
            pieces.append(PieceCuts(wire.name, int(first), points, held))
    for group in line.droppers:
        _check_heights(line, group)
    return Cuts(x, is_mast, tuple(pieces))


def _check_heights(line: Line, group: Droppers) -> None:
    upper, lower = line.wire(group.upper), line.wire(group.lower)
    x = np.array(group.lower_x)
    length = upper.points(np.array(group.upper_x))[:, 2] - lower.points(x)[:, 2]
    short = np.flatnonzero(~(length > 0.0))
    if short.size:
        masts = line.support_positions
        at = x[short[0]]
        span = int(np.searchsorted(masts, at))
        over, under = (name.replace("_", " ") for name in (group.upper, group.lower))
        raise InputError(
            f"at the dropper at {at - masts[span - 1]:g} m of span {span} the {over} is expected "
            f"to hang {-length[short[0]]:.3f} m below the {under}: raise the encumbrance "
            f"({upper.top - lower.top:g} m), raise the {over}'s tension or lower the rise of the "
            "transition spans or of the overlap"
        )
