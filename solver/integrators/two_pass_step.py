"""A line's step without contacts in two passes over its state, for Newmark's family.

Forth, from both ends of the line to its middle: product with K and elimination, station by station.
Back: substitution, correction, and the prediction of the step to come. A step that does these one
after the other reads the state from memory as often as there are of them, which is what long lines
wait for. Two chains of stations go side by side, each of which waits for itself only.
"""

from __future__ import annotations

from itertools import starmap

import numpy as np

from catenary.solver.integrators.line_state import PredictedLineState
from catenary.solver.kernels import aligned_arrays, native
from catenary.solver.linear.step_operators import ByStations
from catenary.solver.model.switching_links import NO_LINKS

# Unknowns of a stretch of the pass back, after which its droppers are looked at: large enough for
# memory to be read ahead, 64 kB of each array, which a cache next to a processor holds.
_STRETCH = 8192
_NO_LOADS = np.zeros(0)


class StationPasses:
    """Takes free steps. Not collective.

    Attributes
    ----------
    native : compiled steps
    are_compiled : whether kernels were compiled for what its stations join
    parts : ``native.PassParts``
    factors : as given
    known : accelerations that the motion keeps besides x, y and z, or none

    Parameters
    ----------
    parts : product, factors and their arrays. The rank's own part of ``read`` is x of the motion,
        other ranks' parts are exchanged before a step; its own part of ``rates`` is y or the
        predicted velocity, that of ``answer`` the acceleration
    loads : forces on all unknowns that are solved for [N], or none, added in the pass forth; kept
        by reference
    motion : motion of the rank's own stations
    """

    def __init__(
        self,
        parts: ByStations,
        loads: np.ndarray,
        motion: PredictedLineState,
    ) -> None:
        product, factors, read, velocity, answer, by_mass = parts
        _, _, low, high, _ = factors.arrays.ends.tolist()
        self.factors = factors
        self.known = motion.known
        starts = factors.stations.starts
        self._starts = starts[low : high + 1] - starts[low]
        self._stretch = max(1, _STRETCH * (high - low) // max(1, int(self._starts[-1])))
        pairs = zip(product.layout.parts, factors.layout.parts, strict=True)
        layouts = [(rows.native, columns.native) for rows, columns in pairs]
        self.are_compiled = all(starmap(native.are_compiled, layouts))
        arrays = native.PassArrays(
            read, velocity, loads, answer, motion.read, self.known, motion.predicted
        )
        stations = product.stations.station_types, product.arrays, factors.arrays
        self.parts = native.PassParts(layouts, *stations, arrays, motion.changes(by_mass))
        self.native = native.TwoPasses(self.parts)
        self.track_links(NO_LINKS, np.zeros(0))

    def track_links(self, links: native.Links, reserve: np.ndarray) -> None:
        """Fill ``reserve`` on the way back, as ``LineIntegrator.track_links``.

        Links are looked at once the pass has left them behind, a stretch of stations at a time.
        """
        self.native.track(self.tracked(links, reserve))

    def tracked(self, links: native.Links, reserve: np.ndarray) -> native.TrackedLinks:
        """Arguments of the kernels for ``track_links``."""
        starts, n = self._starts, self._starts.size - 1
        middle, n_pairs = n // 2, (n - 1) // 2
        n_stretches = max(1, -(-n_pairs // self._stretch))
        # Unknowns that are solved for after each stretch; the last one is all that is left.
        reach = np.minimum(self._stretch * np.arange(1, n_stretches + 1), n_pairs)
        begin, end = starts[middle - reach], starts[middle + reach + 1]
        begin[-1], end[-1] = 0, starts[-1]
        low, high = links.unknowns.min(axis=1), links.unknowns.max(axis=1)
        first = int(np.append(links.unknowns[:, 0] >= starts[middle], True).argmax())

        def counts(low: np.ndarray, high: np.ndarray) -> np.ndarray:
            """How many links, one after the other outwards, are left behind with each stretch."""
            least, most = np.minimum.accumulate(low), np.maximum.accumulate(high)
            inside = np.searchsorted(-least, -begin, side="right"), np.searchsorted(most, end)
            return np.minimum(*inside)

        ranges = np.full((1 + n_stretches, 2), first)
        ranges[1:, 0] -= counts(low[:first][::-1], high[:first][::-1])
        ranges[1:, 1] += counts(low[first:], high[first:])
        return native.TrackedLinks(links, reserve, ranges, self._stretch)

    @property
    def scenes_at_once(self) -> list[int]:
        """Numbers of scenes, ascending, that kernels step side by side on this line."""
        return native.scenes_at_once(self.parts.layouts)

    def arrays_in_lanes(self, n_lanes: int, is_loaded: bool = False) -> native.PassArrays:
        """Arrays of ``n_lanes`` motions at rest; values of an unknown in all lanes are contiguous.

        Loads [N] of whole pairs of unknowns, if there are any, stand where a step puts the
        accelerations: it reads those of a station before. One rank, Newmark's method.
        """
        given = self.parts.arrays
        n = given.motion.x.size
        pad = (given.factor.size - n) // 2
        own = slice(pad * n_lanes, (pad + n) * n_lanes)
        assert np.shares_memory(given.motion.x, given.factor)
        assert np.shares_memory(given.answer, given.motion.z)
        factor, loads, velocity = (
            aligned_arrays.zeros(size * n_lanes, place)
            for place, size in enumerate((given.factor.size, n + n % 2, given.factor.size))
        )
        answer = loads[: n * n_lanes]
        reads_rates = np.shares_memory(given.velocity, given.motion.y)
        motion = native.Motion(factor[own], velocity[own], answer, given.motion.shares, n_lanes)
        return given._replace(
            factor=factor,
            velocity=velocity if reads_rates else factor,
            loads=loads if is_loaded else _NO_LOADS,
            answer=answer,
            motion=motion,
        )
