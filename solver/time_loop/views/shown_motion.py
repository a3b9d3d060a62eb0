"""The line's motion at the step that is shown, brought up to date where the line has moved."""

from __future__ import annotations

import numpy as np

from catenary.solver.integrators.line_integrator import LineIntegrator
from catenary.solver.kernels import aligned_arrays, native
from catenary.solver.window.moving_columns import Columns, widen


class ShownMotion:
    """Displacement and velocity of a rank's unknowns, kept from one look to the next.

    Of a line of which a window moves a look takes what the window takes. Not collective.

    Parameters
    ----------
    line : LineIntegrator
    columns : with the stations of the line, and which of them move
    pad : zeros that arrays have at either end, for products that read beyond the line

    Attributes
    ----------
    moved : (2,) first station that has moved since the latest look, and the one after the last;
        those who step the line keep it
    changed : (2,) the same of what looks have changed, until ``take_changes``
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
        """Show a step that the line has left, from what was kept of it.

        Parameters
        ----------
        stations : tuple of int
            Stations that had moved since the look before, see ``moved``.
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
        """First station that has changed since it was asked for last, and the one after the last;
        the first is not before the last if none has."""
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
