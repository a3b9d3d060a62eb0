"""A window of moving stations as kernels take it.

Stations outside of the window are at rest: no step reads or writes them, but for the ones beside
it, which are held where they are.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from catenary.solver.linear.factors.meeting_station import Turning

# Numbers of ``WindowArrays.state``.
STEP, IS_FRESH = 0, 1


class WindowArrays(NamedTuple):
    """A window as kernels take it.

    Attributes
    ----------
    state : (2,) int, steps taken, and whether the whole line is still alive
    every, guard : steps between two looks, and stations that are looked at
    by_motion : share of the largest motion below which stations rest, 0 if spans decide
    spans_behind, spans_ahead : these
    fading : how much fades at a look [m2]
    is_exact : whether what rests is made zero, or stays where it is
    peak : (2,) largest of x and y of the motion
    contacts : (n,) where contacts are [m], by reference
    loaded : (2,) first and last place with a load [m]
    margin : how far around both a step and what switches in it reach [m]
    masts : (k,) where spans end [m]
    low, high : (n,) of stations, see ``Unknowns``
    starts : (n + 1,) first unknown of each station
    links_before : (n + 1,) how many links stand before each
    edges : (2, n + 1) where a window that is to begin, or end, at a station does so
    ends, kinds, turning : of ``StationFactors``
    links : (2,) the first link that may switch and the one after the last
    ranges : (2, 2) the same for the pass back, see ``StationPasses.track_links``
    known : what the motion keeps besides x, y and z, or nothing
    """

    state: np.ndarray
    every: int
    guard: int
    by_motion: float
    spans_behind: float
    spans_ahead: float
    fading: float
    is_exact: bool
    peak: np.ndarray
    contacts: np.ndarray
    loaded: np.ndarray
    margin: float
    masts: np.ndarray
    low: np.ndarray
    high: np.ndarray
    starts: np.ndarray
    links_before: np.ndarray
    edges: np.ndarray
    ends: np.ndarray
    kinds: np.ndarray
    turning: Turning
    links: np.ndarray
    ranges: np.ndarray
    known: np.ndarray
