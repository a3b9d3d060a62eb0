"""The energy of the line at the step that is shown, summed anew where the line has moved."""

from __future__ import annotations

import numpy as np

from catenary.solver.contact.followed_links import FollowedLinks
from catenary.solver.integrators.line_integrator import LineIntegrator
from catenary.solver.time_loop.shown_motion import ShownMotion
from catenary.solver.window.moving_columns import Columns, columns_of

# Stations, and links, that are summed together where only a part of the line moves.
_STATIONS, _LINKS = 128, 256


class LineEnergy:
    """Kinetic and elastic energy of a rank's part of a line.

    What rests adds what it has added before. Collective, as its methods.

    Parameters
    ----------
    line : LineIntegrator
    links : of the line
    load : (n_local,) forces that act on it all the time [N]
    columns : with the stations of the line, as of ``motion``
    """

    def __init__(
        self, line: LineIntegrator, links: FollowedLinks, load: np.ndarray, columns: Columns
    ) -> None:
        self._line, self._links = line, links
        self._loaded = np.flatnonzero(load)
        self._load = load[self._loaded]
        self._products = line.operators.by_rows()
        n, n_links = line.ownership.n_local, links.numbers.size
        in_parts = line.window is not None and self._products is not None
        self._edges = _edges(columns.n_stations, _STATIONS if in_parts else columns.n_stations)
        self._starts = columns.starts[self._edges]
        # Without a window the line is one station, of which a product has many rows.
        self._rows = self._edges
        if not in_parts and self._products is not None:
            self._rows = np.array([0, self._products[0].kinds.size])
        self._link_edges = _edges(n_links, _LINKS if in_parts else n_links)
        stations = None if line.window is None else line.window.stations
        self._of_links = columns_of((links.links.unknowns,), n, stations)
        self._force = np.zeros(n)
        self._sums = np.zeros((2, self._edges.size - 1))
        self._switched = np.zeros(self._link_edges.size - 1)

    @property
    def pad(self) -> int:
        """Zeros that ``padded`` of a motion needs at either end."""
        return 0 if self._products is None else self._products[2]

    def parts(self, motion: ShownMotion) -> np.ndarray:
        """What this rank adds to kinetic and elastic energy, the latter relative to rest without
        loads, links switched as they are [J], shape (2,)."""
        begin, end = motion.take_changes()
        displacement = motion.displacement
        if self._products is None:
            parts = self._line.energy_parts(displacement, motion.velocity)
        else:
            if begin < end:
                # What joins two stations changes with either.
                n = int(self._edges[-1])
                self._sum_stations(motion, max(0, begin - 1), min(n, end + 1))
            parts = 0.5 * self._sums.sum(axis=1)
        if begin < end:
            self._sum_links(displacement, begin, end)
        elastic = self._switched.sum() - self._load @ displacement[self._loaded]
        return np.array([parts[0], parts[1] + elastic])

    def _sum_stations(self, motion: ShownMotion, begin: int, end: int) -> None:
        assert self._products is not None
        first, last = _covering(self._edges, begin, end)
        rows = int(self._rows[first]), int(self._rows[last])
        own = slice(int(self._starts[first]), int(self._starts[last]))
        force, arrays = self._force, (motion.velocity, motion.displacement)
        factors = motion.padded[1], motion.padded[0]
        for sums, product, factor, array in zip(
            self._sums, self._products[:2], factors, arrays, strict=True
        ):
            product.multiply_rows(*rows, factor, force)
            if last == first + 1:
                sums[first] = force[own] @ array[own]
            elif last > first:
                places = self._starts[first:last] - own.start
                sums[first:last] = np.add.reduceat(force[own] * array[own], places)

    def _sum_links(self, displacement: np.ndarray, begin: int, end: int) -> None:
        columns = self._of_links
        links = int(columns.first[begin, 0]), int(columns.last[end, 0])
        if links[0] >= links[1]:
            return
        for part in range(*_covering(self._link_edges, *links)):
            own = self._link_edges[part : part + 2].tolist()
            self._switched[part] = self._links.energy_of_switching(displacement, *own)


def _edges(n: int, size: int) -> np.ndarray:
    """Where parts of ``size`` begin that ``n`` are divided into, and where the last one ends."""
    return np.append(np.arange(0, n, max(1, size)), n)


def _covering(edges: np.ndarray, begin: int, end: int) -> tuple[int, int]:
    """The first of the parts between ``edges`` that reaches into a range, and the one after the
    last."""
    first = int(np.searchsorted(edges, begin, side="right")) - 1
    return max(0, first), min(int(np.searchsorted(edges, end)), edges.size - 1)
