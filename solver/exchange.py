"""The step's messages: every rank's share of the inner problem to rank 0, the forces back.

One gather and one broadcast of fixed size a step, whatever the number of ranks; they also carry
the wish to stop and the news of a failure, so that all ranks leave the loop at the same step.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Any, NamedTuple

import numpy as np

from catenary.solver.response import LineResponse

_FIRST_CAPACITY = 32
_NO_NUMBERS, _NO_FORCES = np.zeros(0, dtype=np.int64), np.zeros(0)


class Verdict(IntEnum):
    """What rank 0 tells the others after the inner problem."""

    ADVANCE = 0
    ADVANCE_AND_STOP = 1
    REPEAT = 2
    ENLARGE = 3
    BROKEN = 4


class Reply(NamedTuple):
    """Rank 0's answer: verdict, contact forces (n,) [N], slack droppers and compensations [N].

    ``room`` is how many droppers a rank needs room for, with the verdict ``ENLARGE``.
    """

    verdict: Verdict
    contact_force: np.ndarray
    droppers: np.ndarray = _NO_NUMBERS
    compensation: np.ndarray = _NO_FORCES
    room: int = 0


class Exchange:
    """Gathers and broadcasts for ``n_contacts``. All methods are collective.

    Attributes
    ----------
    share : this rank's share of the inner problem, to be filled in before ``to_root``

    Parameters
    ----------
    early : whether shares hold what the line extrapolates to
    """

    def __init__(self, comm: Any, n_contacts: int, early: bool) -> None:
        self._comm = comm
        self._n = n_contacts
        self._early = early
        self.enlarge(_FIRST_CAPACITY)

    def enlarge(self, capacity: int) -> None:
        """Make room for at least ``capacity`` droppers a rank."""
        n, size, is_root = self._n, self._comm.size, self._comm.rank == 0
        self.share = LineResponse(n, capacity, self._early)
        self._merged, self._all = self.share, None
        self._answer = np.zeros(3 + n)
        if size > 1:
            self._answer = np.zeros(3 + n + 2 * capacity * size)
            if is_root:
                self._merged = LineResponse(n, capacity * size, self._early)
                self._all = np.zeros((size, self.share.packet.size))

    def to_root(self) -> LineResponse | None:
        """Sum of all shares on rank 0, None elsewhere."""
        if self._comm.size == 1:
            return self.share
        self._comm.Gather(self.share.packet, self._all, root=0)
        return self._merge() if self._all is not None else None

    def missing_room(self, merged: LineResponse) -> int:
        """How many droppers a rank had to report if they did not fit, otherwise 0. Rank 0 only."""
        counts = [merged.count] if self._all is None else self._all[:, 0]
        most = int(max(counts))
        return most if most > self.share.capacity else 0

    def from_root(self, reply: Reply | None) -> Reply:
        """Rank 0's reply on all ranks; None is passed elsewhere."""
        if self._comm.size == 1:
            assert reply is not None
            return reply
        answer, n = self._answer, self._n
        if reply is not None:
            count = reply.droppers.size
            answer[:3] = reply.verdict, count, reply.room
            answer[3 : 3 + n] = reply.contact_force
            answer[3 + n : 3 + n + count] = reply.droppers
            answer[3 + n + count : 3 + n + 2 * count] = reply.compensation
        self._comm.Bcast(answer, root=0)
        count = int(answer[1])
        return Reply(
            Verdict(int(answer[0])),
            answer[3 : 3 + n].copy(),
            answer[3 + n : 3 + n + count].astype(np.int64),
            answer[3 + n + count : 3 + n + 2 * count].copy(),
            int(answer[2]),
        )

    def _merge(self) -> LineResponse:
        """All shares as one: sums, and the rows one after the other."""
        parts, merged, size = self._all, self._merged, self.share.n_summed
        assert parts is not None
        parts[:, :size].sum(axis=0, out=merged.packet[:size])
        counts = np.minimum(parts[:, 0], self.share.capacity).astype(int)
        end = 0
        for part, count in zip(parts[:, size:], counts, strict=True):
            if count:
                rows = part.reshape(self.share.rows.shape)
                merged.rows[end : end + count] = rows[:count]
                end += count
        merged.count = end
        return merged
