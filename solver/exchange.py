"""The step's messages: every rank's share of the inner problem to rank 0, the forces back.

One gather and one broadcast of fixed size a step, whatever the number of ranks; they also carry
the wish to stop and the news of a failure, so that all ranks leave the loop at the same step.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Any, NamedTuple

import numpy as np

from catenary.solver.inner import LineResponse

_FIRST_CAPACITY = 32


class Verdict(IntEnum):
    """What rank 0 tells the others after the inner problem."""

    ADVANCE = 0
    ADVANCE_AND_STOP = 1
    REPEAT = 2
    ENLARGE = 3
    BROKEN = 4


class Merged(NamedTuple):
    """All ranks' shares on rank 0: the response, and whether any rank wants to stop, holds
    something that is no number, or had more droppers to report than fit."""

    response: LineResponse
    stop: bool
    broken: bool
    overflow: int


class Reply(NamedTuple):
    """Rank 0's answer: verdict, contact forces (n,) [N], slack droppers and compensations [N]."""

    verdict: Verdict
    contact_force: np.ndarray
    droppers: np.ndarray
    compensation: np.ndarray


class Exchange:
    """Packs, gathers and broadcasts for ``n`` contacts. All methods are collective.

    ``early`` says whether shares hold what the line extrapolates to.
    """

    def __init__(self, comm: Any, n_contacts: int, early: bool) -> None:
        self._comm = comm
        self._n = n_contacts
        self._n_early = n_contacts if early else 0
        self.enlarge(_FIRST_CAPACITY)

    def enlarge(self, capacity: int) -> None:
        """Make room for at least ``capacity`` droppers a rank."""
        n, size = self._n, self._comm.size
        self._capacity = capacity
        self._head = 4 + 2 * n + 2 * n * n + 2 * self._n_early
        self._row = 2 + 3 * n
        self._packet = np.zeros(self._head + capacity * self._row)
        self._all = np.zeros((size if self._comm.rank == 0 else 0, self._packet.size))
        self._answer = np.zeros(2 + n + 2 * capacity * size)

    def to_root(self, share: LineResponse, stop: bool, broken: bool) -> Merged | None:
        """Sum of all shares on rank 0, None elsewhere."""
        if self._comm.size == 1:
            return Merged(share, stop, broken, 0)
        packet, count = self._packet, share.droppers.size
        packet[:4] = count, stop, broken, 0
        fitting = min(count, self._capacity)
        at = 4
        for part in (
            share.height,
            share.rate,
            share.height_by_force,
            share.rate_by_force,
            share.early_height,
            share.early_rate,
        ):
            packet[at : at + part.size] = part.ravel()
            at += part.size
        rows = packet[self._head :].reshape(-1, self._row)[:fitting]
        rows[:, 0] = share.droppers[:fitting]
        rows[:, 1] = share.tension[:fitting]
        columns = rows[:, 2:].reshape(fitting, 3, self._n)
        columns[:, 0] = share.tension_by_force[:fitting]
        columns[:, 1] = share.height_by_slack[:fitting]
        columns[:, 2] = share.rate_by_slack[:fitting]
        self._comm.Gather(packet, self._all if self._comm.rank == 0 else None, root=0)
        return self._merge() if self._comm.rank == 0 else None

    def from_root(self, reply: Reply | None) -> Reply:
        """Rank 0's reply on all ranks; None is passed elsewhere."""
        if self._comm.size == 1:
            assert reply is not None
            return reply
        answer, n = self._answer, self._n
        if reply is not None:
            count = reply.droppers.size
            answer[:2] = reply.verdict, count
            answer[2 : 2 + n] = reply.contact_force
            answer[2 + n : 2 + n + count] = reply.droppers
            answer[2 + n + count : 2 + n + 2 * count] = reply.compensation
        self._comm.Bcast(answer, root=0)
        count = int(answer[1])
        return Reply(
            Verdict(int(answer[0])),
            answer[2 : 2 + n].copy(),
            answer[2 + n : 2 + n + count].astype(int),
            answer[2 + n + count : 2 + n + 2 * count].copy(),
        )

    def _merge(self) -> Merged:
        n, parts = self._n, self._all
        total = parts[:, 4 : self._head].sum(axis=0)
        counts = parts[:, 0].astype(int)
        rows = [
            parts[rank, self._head :].reshape(-1, self._row)[: min(count, self._capacity)]
            for rank, count in enumerate(counts)
        ]
        table = np.concatenate(rows)
        columns = table[:, 2:].reshape(-1, 3, n)
        sizes = np.array([n, n, n * n, n * n, self._n_early, self._n_early])
        height, rate, by_force, rate_by_force, early_height, early_rate = np.split(
            total, np.cumsum(sizes)[:-1]
        )
        response = LineResponse(
            height,
            rate,
            by_force.reshape(n, n),
            rate_by_force.reshape(n, n),
            table[:, 0].astype(int),
            table[:, 1],
            columns[:, 0],
            columns[:, 1],
            columns[:, 2],
            early_height,
            early_rate,
        )
        largest = int(counts.max())
        overflow = largest if largest > self._capacity else 0
        return Merged(response, bool(parts[:, 1].any()), bool(parts[:, 2].any()), overflow)
