"""The line at the step that is shown: its motion, brought up to date where it has moved; energy."""

from __future__ import annotations

import numpy as np

from catenary.solver.contact.forces_on_line import FollowedLinks
from catenary.solver.integrators.line_integrator import LineIntegrator
from catenary.solver.kernels import aligned_arrays, native
from catenary.solver.window.moving_columns import Columns, columns_of, widen


class ShownMotion:
    """Displacement and velocity of a rank's unknowns, brought up to date when they are read.

    With a window only stations that have moved are updated. Not collective.

    Parameters
    ----------
    line : LineIntegrator
    columns : Columns, with the stations of the line and the range that moves
    pad : number of zeros at either end of the arrays, for products that read beyond the line

    Attributes
    ----------
    moved : (2,) first station that has moved since the latest update, and the one after the last;
        steps widen it
    changed : (2,) the same for stations updated since the latest ``take_changes``
    """

    def __init__(self, line: LineIntegrator, columns: Columns, pad: int) -> None:
        n = line.ownership.n_local
        self._columns, self._is_late = columns, True
        self.padded = tuple(aligned_arrays.zeros(n + 2 * pad, place) for place in (4, 5))
        self._displacement, self._velocity = (array[pad : pad + n] for array in self.padded)
        self.moved = np.array([0, columns.n_stations])
        self.changed = self.moved.copy()
        self._motion = line.motion.read

    def late(self, *, followed: bool) -> None:
        """Say that the line stands at the step to be shown, all of it if nobody has ``followed``
        what moved."""
        self._is_late = True
        if followed:
            widen(self.moved, *self._columns.ends[:2].tolist())
        else:
            self.moved[:] = 0, self._columns.n_stations

    def show(self, stations: tuple[int, int], numbers: np.ndarray) -> None:
        """Show an earlier step from its kept motion.

        Parameters
        ----------
        stations : tuple of int
            Stations that had moved since the update before, see ``moved``.
        numbers : ndarray
            Displacements, then velocities, of these stations' unknowns.
        """
        starts = self._columns.starts
        own = slice(int(starts[stations[0]]), int(starts[stations[1]]))
        size = own.stop - own.start
        self._displacement[own] = numbers[:size]
        self._velocity[own] = numbers[size:]
        self._is_late = False
        widen(self.changed, *stations)

    @property
    def displacement(self) -> np.ndarray:
        """(n_local,) [m]; overwritten when it is read next."""
        self._bring_up_to_date()
        return self._displacement

    @property
    def velocity(self) -> np.ndarray:
        """(n_local,) [m/s]; overwritten when it is read next."""
        self._bring_up_to_date()
        return self._velocity

    def take_changes(self) -> tuple[int, int]:
        """First station that has changed since the latest call, and the one after the last; if none
        has, the first is not less than the second."""
        self._bring_up_to_date()
        begin, end = self.changed.tolist()
        self.changed[0], self.changed[1] = self._columns.n_stations, 0
        return begin, end

    def _bring_up_to_date(self) -> None:
        if not self._is_late:
            return
        begin, end = self._columns.starts[self.moved].tolist()
        native.displacements(self._motion, begin, self._displacement[begin:end])
        native.velocities(self._motion, begin, self._velocity[begin:end])
        widen(self.changed, *self.moved.tolist())
        self.moved[:] = self._columns.ends[:2]
        self._is_late = False


# Stations, and links, that are summed together where only a part of the line moves.
_STATIONS, _LINKS = 128, 256


class LineEnergy:
    """Kinetic and elastic energy of a rank's part of a line.

    What rests adds what it has added before. Only what a window of spans has left adds nothing: it
    is held where it was when the window went on, with the elastic energy of a motion that on a line
    without a window would have faded. Collective, as its methods.

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
        self._size = _STATIONS if in_parts else max(1, columns.n_stations)
        self._links_size = _LINKS if in_parts else max(1, n_links)
        # Begins of the parts, and the end of the last one.
        self._edges = np.append(np.arange(0, columns.n_stations, self._size), columns.n_stations)
        self._starts, self._station_starts = columns.starts[self._edges], columns.starts
        # Without a window the line is one station, of which a product has many rows.
        self._rows = self._edges
        if not in_parts and self._products is not None:
            self._rows = np.array([0, self._products[0].arrays.kinds.size])
        stations = None if line.window is None else line.window.stations
        self._of_links = columns_of((links.links.unknowns,), n, stations)
        self._force = np.zeros(n)
        self._sums = np.zeros((2, self._edges.size - 1))
        self._switched = np.zeros(-(-n_links // self._links_size))
        # What adds energy begins with this station, and with this link.
        self._first = self._first_link = 0

    @property
    def pad(self) -> int:
        """Zeros that ``padded`` of a motion needs at either end."""
        return 0 if self._products is None else self._products[2]

    def parts(self, motion: ShownMotion, contacts: np.ndarray) -> np.ndarray:
        """This rank's share of kinetic and elastic energy, the latter relative to rest without
        loads, links switched as they are [J], shape (2,); ``contacts`` (n,) are where those of the
        train are [m]."""
        begin, end = motion.take_changes()
        displacement, velocity = motion.displacement, motion.velocity
        self._leave(contacts)
        begin = max(begin, self._first)
        if self._products is None:
            parts = self._line.energy_parts(displacement, velocity)
        else:
            if begin < end:
                # Rows that join two stations change with either.
                self._sum_stations(
                    motion, max(self._first, begin - 1), min(int(self._edges[-1]), end + 1)
                )
            parts = 0.5 * np.add.reduce(self._sums, axis=1)
        if begin < end:
            self._sum_links(displacement, begin, end)
        parts[1] += np.add.reduce(self._switched)
        if self._loaded.size:
            parts[1] -= self._load @ displacement[self._loaded]
        return parts

    def _leave(self, contacts: np.ndarray) -> None:
        """Take away what the window has left. The part with its first station has always changed,
        as stations move there."""
        window = self._line.window
        # A load that stays moves a line away from rest for good, wherever the train is.
        if window is None or self._loaded.size:
            return
        self._first = window.first_of_spans(contacts)
        self._sums[:, : np.searchsorted(self._edges, self._first, side="right") - 1] = 0.0
        self._first_link = int(self._of_links.first[self._first, 0])
        self._switched[: self._first_link // self._links_size] = 0.0

    def _sum_stations(self, motion: ShownMotion, begin: int, end: int) -> None:
        window = self._line.window
        first, last = begin // self._size, -(-end // self._size)
        together = last if window is None else max(1, (window.most_rows - 2) // self._size)
        for part in range(first, last, together):
            self._sum_parts(motion, part, min(part + together, last))

    def _sum_parts(self, motion: ShownMotion, first: int, last: int) -> None:
        """Sum the parts from ``first`` to before ``last``."""
        assert self._products is not None
        window, both = self._line.window, (motion.displacement, motion.velocity)
        if window is not None and not window.has_rows(*self._rows[[first, last]].tolist()):
            # Stations that have not moved need no rows.
            own = slice(*self._starts[[first, last]].tolist())
            self._sums[:, first:last] = 0.0
            moved = own.start + np.flatnonzero((both[0][own] != 0) | (both[1][own] != 0))
            if not moved.size:
                return
            first, last = np.searchsorted(self._starts, moved[[0, -1]], side="right") + (-1, 0)
        begin, end = self._rows[[first, last]].tolist()
        own = slice(*self._starts[[first, last]].tolist())
        if window is not None:
            window.provide_rows(begin, end)
        for row, product in enumerate(self._products[:2]):
            # The kinetic energy is that of the velocity.
            factor, values = motion.padded[1 - row], both[1 - row][own]
            product.multiply_rows(begin, end, factor, self._force)
            force = self._force[own]
            force[: max(0, int(self._station_starts[self._first]) - own.start)] = 0.0
            if last == first + 1:
                self._sums[row, first] = force @ values
            else:
                places = self._starts[first:last] - own.start
                self._sums[row, first:last] = np.add.reduceat(force * values, places)

    def _sum_links(self, displacement: np.ndarray, begin: int, end: int) -> None:
        first, last = int(self._of_links.first[begin, 0]), int(self._of_links.last[end, 0])
        size = self._links_size
        for part in range(first // size, -(-last // size) if first < last else 0):
            own = (
                max(size * part, self._first_link),
                min(size * (part + 1), self._links.numbers.size),
            )
            self._switched[part] = self._links.energy_of_switching(displacement, *own)
