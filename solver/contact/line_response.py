"""The line's side of the inner problem, as a rank sends it."""

from __future__ import annotations

import numpy as np

# Columns of a row of a dropper that may slacken, before its 3 n numbers for n contacts.
NUMBER, TENSION, COUPLINGS = 0, 1, 2
# Numbers before the answers in ``LineResponse.summed``: droppers with a row, wish to stop, whether
# something is no number, droppers that there is no room for.
FLAGS = 4


class LineResponse:
    """Answers of the line to n contacts, and a row for each dropper that may slacken.

    Attributes
    ----------
    summed : everything that adds up over ranks, in one array; the others but ``rows`` are its views
    height, rate : (n,) free wire height [m] and its total rate [m/s] at the contacts
    height_by_force, rate_by_force : (n, n) B [m/N] and its rate [m/(N s)]
    answers : (2 n + 2 n^2,) these four one after the other
    early_height, early_rate : (n,) what the line's motion extrapolates to, or (0,) if not asked
    limits : (n + 1,) contact forces [N], and a margin [N] that slack droppers may take off others:
        whatever goes slack within them has a row; kept by reference
    rows : (capacity, 2 + 3 n): number of a dropper, tension T0 [N], and for the contacts Q [-], P
        [m/N] and the rate of P [m/(N s)]

    Parameters
    ----------
    n_contacts, capacity : how many contacts and droppers there is room for
    early : whether there is room for what the motion extrapolates to
    limits : there are none if left out
    """

    def __init__(
        self,
        n_contacts: int,
        capacity: int,
        early: bool = False,
        limits: np.ndarray | None = None,
    ) -> None:
        n, n_early = n_contacts, n_contacts if early else 0
        self.n_contacts, self.capacity = n, capacity
        sizes = (FLAGS, n, n, n * n, n * n, n_early, n_early)
        self.summed = np.zeros(sum(sizes))
        parts = np.split(self.summed, np.cumsum(sizes)[:-1])
        self._flags, self.height, self.rate = parts[:3]
        self.height_by_force = parts[3].reshape(n, n)
        self.rate_by_force = parts[4].reshape(n, n)
        self.answers = self.summed[FLAGS : FLAGS + 2 * n * (1 + n)]
        self.early_height, self.early_rate = parts[5:]
        self.rows = np.zeros((capacity, COUPLINGS + 3 * n))
        self.limits = np.full(n + 1, np.inf) if limits is None else limits

    @property
    def count(self) -> int:
        """Number of droppers that may slacken and have a row."""
        return int(self._flags[0])

    @property
    def flags(self) -> tuple[float, float, float, float]:
        """The number of droppers with a row, whether a rank wants this step to be the last, whether
        one holds something that is no number, and for how many droppers one had no room."""
        count, stop, broken, missing = self._flags.tolist()
        return count, stop, broken, missing

    def put_stop(self, stop: bool) -> None:
        """Say whether this rank wants this step to be the last."""
        self._flags[1] = stop

    @property
    def droppers(self) -> np.ndarray:
        """Numbers of the droppers with a row (m,)."""
        return self.rows[: self.count, NUMBER].astype(np.int64)

    @property
    def tension(self) -> np.ndarray:
        """T0 (m,) [N]."""
        return self.rows[: self.count, TENSION]

    def couplings(self, kind: int) -> np.ndarray:
        """Q, P or the rate of P, for ``kind`` 0, 1 or 2, shape (m, n)."""
        begin = COUPLINGS + kind * self.n_contacts
        return self.rows[: self.count, begin : begin + self.n_contacts]
