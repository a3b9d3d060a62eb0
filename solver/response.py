"""The line's side of the inner problem, as the one array that a rank sends."""

from __future__ import annotations

import numpy as np

from catenary.solver.inner_kernels import COUPLINGS, NUMBER, TENSION


class LineResponse:
    """Answers of the line to n contacts, and a row for each dropper that may slacken.

    Attributes
    ----------
    packet : everything in one array; all below are views of it
    height, rate : (n,) free wire height [m] and its total rate [m/s] at the contacts
    height_by_force, rate_by_force : (n, n) B [m/N] and its rate [m/(N s)]
    early_height, early_rate : (n,) what the line's motion extrapolates to, or (0,) if not asked
    rows : (capacity, 2 + 3 n): number of a dropper, tension T0 [N], and for the contacts Q [-], P
        [m/N] and the rate of P [m/(N s)]

    Parameters
    ----------
    n_contacts, capacity : how many contacts and droppers there is room for
    early : whether there is room for what the motion extrapolates to
    """

    def __init__(self, n_contacts: int, capacity: int, early: bool = False) -> None:
        n, n_early = n_contacts, n_contacts if early else 0
        self.n_contacts, self.capacity = n, capacity
        sizes = (4, n, n, n * n, n * n, n_early, n_early)
        self.n_summed = sum(sizes)
        self.packet = np.zeros(self.n_summed + capacity * (COUPLINGS + 3 * n))
        parts = np.split(self.packet[: self.n_summed], np.cumsum(sizes)[:-1])
        self._flags, self.height, self.rate = parts[:3]
        self.height_by_force = parts[3].reshape(n, n)
        self.rate_by_force = parts[4].reshape(n, n)
        self.early_height, self.early_rate = parts[5:]
        self.rows = self.packet[self.n_summed :].reshape(capacity, COUPLINGS + 3 * n)

    @property
    def count(self) -> int:
        """Number of droppers that may slacken; beyond ``capacity`` they have no row."""
        return int(self._flags[0])

    @count.setter
    def count(self, count: int) -> None:
        self._flags[0] = count

    @property
    def wants_to_stop(self) -> bool:
        """Whether a rank wants this step to be the last."""
        return bool(self._flags[1])

    @wants_to_stop.setter
    def wants_to_stop(self, stop: bool) -> None:
        self._flags[1] = stop

    @property
    def is_broken(self) -> bool:
        """Whether a rank holds something that is no number."""
        return bool(self._flags[2])

    @is_broken.setter
    def is_broken(self, broken: bool) -> None:
        self._flags[2] = broken

    @property
    def droppers(self) -> np.ndarray:
        """Numbers of the droppers with a row (m,)."""
        return self.rows[: min(self.count, self.capacity), NUMBER].astype(np.int64)

    @property
    def tension(self) -> np.ndarray:
        """T0 (m,) [N]."""
        return self.rows[: min(self.count, self.capacity), TENSION]

    def couplings(self, kind: int) -> np.ndarray:
        """Q, P or the rate of P, for ``kind`` 0, 1 or 2, shape (m, n)."""
        begin = COUPLINGS + kind * self.n_contacts
        return self.rows[: min(self.count, self.capacity), begin : begin + self.n_contacts]
