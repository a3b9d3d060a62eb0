"""The contact wire at rest as a pantograph meets it: its height, gradients, and sweep."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from catenary.postproc.read.line_of_run import ContactProfile
from catenary.postproc.read.results import Results

# A smaller gradient, a millimetre from mast to mast, is none: erection leaves ten times that [-].
_NO_GRADIENT = 2e-5
# Wires that differ by less in height are both met [m].
_SAME_HEIGHT = 1e-3


class WireAtRest(NamedTuple):
    """The lowest contact wire along the evaluation stretch, which a head meets.

    Attributes
    ----------
    x : (n,) nodes of the contact wires along the track, ascending [m]
    height : (n,) above the rail [m]
    y : (m, 2) place of a node along the track and to the left, of wires that are met [m]; None
        where no wire moves sideways
    sweep : mean of |dy/dx| along the wires that are met [-], None likewise
    """

    x: np.ndarray
    height: np.ndarray
    y: np.ndarray | None
    sweep: float | None

    def gradients(self, masts: np.ndarray) -> np.ndarray:
        """Gradients between successive ``masts`` (n,) [m] in the stretch, shape (n - 1,) [-]."""
        height = np.interp(masts, self.x, self.height)
        slopes = np.diff(height) / np.diff(masts)
        return np.where(np.abs(slopes) < _NO_GRADIENT, 0.0, slopes)


def wire_at_rest(results: Results) -> WireAtRest | None:
    """The contact wire at rest in the evaluation stretch, None if no node is there. Not
    collective."""
    profiles = list(results.contact_profiles().values())
    start, end = results.evaluation
    x = np.unique(np.concatenate([profile.x for profile in profiles]))
    x = x[(x >= start) & (x <= end)]
    if not x.size:
        return None
    heights = np.array([_height_at(profile, x) for profile in profiles])
    lowest = np.nanmin(heights, axis=0)
    y, sweep = _lateral(profiles, x, lowest)
    return WireAtRest(x, lowest, y, sweep)


def _pieces(profile: ContactProfile) -> Iterator[slice]:
    ends = [0, *profile.breaks.tolist(), profile.x.size]
    yield from (slice(a, b) for a, b in zip(ends[:-1], ends[1:], strict=True) if b > a)


def _height_at(profile: ContactProfile, x: np.ndarray) -> np.ndarray:
    """Height of the lowest piece of a wire [m], infinite where it has none."""
    height = np.full(x.size, np.inf)
    for piece in _pieces(profile):
        own = np.interp(x, profile.x[piece], profile.height[piece], np.inf, np.inf)
        height = np.minimum(height, own)
    return height


def _lateral(
    profiles: list[ContactProfile], x: np.ndarray, lowest: np.ndarray
) -> tuple[np.ndarray | None, float | None]:
    """Lateral positions and sweep of wires where they are met."""
    places, swept, length = [], 0.0, 0.0
    for profile in profiles:
        if profile.y is None:
            return None, None
        for piece in _pieces(profile):
            at, y, height = profile.x[piece], profile.y[piece], profile.height[piece]
            met = (at >= x[0]) & (at <= x[-1])
            met &= height <= np.interp(at, x, lowest) + _SAME_HEIGHT
            places.append(np.column_stack([at[met], y[met]]))
            both = met[:-1] & met[1:]
            swept += float(np.abs(np.diff(y))[both].sum())
            length += float(np.diff(at)[both].sum())
    return np.concatenate(places), swept / length if length else None
