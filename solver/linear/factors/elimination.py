"""Block elimination of a line, station by station, each kind of factor worked out once.

What elimination carries from span to span is forgotten within the reach of A^-1. Where spans are
alike the factor of a station and the kind of the next one are then a pair that was there before,
and the next factor is known.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from catenary.solver.kernels import native


class StationBlocks(NamedTuple):
    """Blocks (k, b, b) of each kind of station: those that join it to the one ``before``, its
    ``own``, and those that join it to the one ``after``; see ``StationRows``."""

    before: np.ndarray
    own: np.ndarray
    after: np.ndarray


class Eliminated(NamedTuple):
    """Stations after elimination from one end.

    Attributes
    ----------
    factors : (m, 2, b, b) S^-1 and -S^-1 B of each factor; S is the diagonal block after
        elimination, B joins it to the next station
    kinds : (m,) kind of station that each factor is of
    numbers : (n,) int32, the factor of each station
    """

    factors: np.ndarray
    kinds: np.ndarray
    numbers: np.ndarray


def eliminate_stations(kinds: np.ndarray, blocks: StationBlocks, from_end: bool) -> Eliminated:
    """Stations of ``kinds`` (n,) int32 eliminated one after the other, from the start of the line
    or ``from_end``."""
    return Eliminated(*native.eliminate(kinds, blocks, from_end))
