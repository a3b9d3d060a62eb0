"""The messages of a step, timed between the ranks that there are.

The same kinds of messages as in a march: persistent ones between neighbours, one reduction to rank
0, one broadcast.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from mpi4py import MPI

from catenary.base.parallel import wait_for_all

# Sizes of messages that latency and bandwidth are found from [B].
SIZES = (8, 512, 4096, 32768, 262144)
# Blocks of exchanges, of which the fastest counts, and exchanges in each.
BLOCKS, EXCHANGES = 25, 20


class Wire(NamedTuple):
    """What a message takes: ``latency`` [s] and ``per_byte`` [s/B]."""

    latency: float
    per_byte: float

    def message(self, n_bytes: float) -> float:
        """Time of a message [s]."""
        return self.latency + n_bytes * self.per_byte


class Sizes(NamedTuple):
    """Messages of a step [B]: to a neighbour, to rank 0 and back from there."""

    neighbour: int
    share: int
    reply: int


def wire_between(comm: Any) -> Wire | None:
    """Latency and time per byte between ranks 0 and 1, on all ranks; None on one rank. Collective.

    The others sleep meanwhile.
    """
    if comm.size == 1:
        return None
    times = [_ping(comm, size) for size in SIZES] if comm.rank < 2 else []
    wait_for_all(comm)
    found: Wire | None = None
    if comm.rank == 0:
        per_byte, latency = np.polyfit(SIZES, times, 1, w=1.0 / np.array(times))
        # The line through noisy times may begin below them.
        found = Wire(max(float(latency), 0.1 * min(times)), max(float(per_byte), 0.0))
    result: Wire | None = comm.bcast(found)
    return result


def _ping(comm: Any, n_bytes: int) -> float:
    """Time of a message one way, between ranks 0 and 1 [s]."""
    buffer, other = np.zeros(n_bytes, dtype=np.uint8), 1 - comm.rank

    def there_and_back() -> None:
        if comm.rank == 0:
            comm.Send(buffer, dest=other)
            comm.Recv(buffer, source=other)
        else:
            comm.Recv(buffer, source=other)
            comm.Send(buffer, dest=other)

    return 0.5 * _fastest(there_and_back)[0]


def time_of_exchange(comm: Any, sizes: Sizes) -> tuple[float, float]:
    """Time of all messages of a step on these ranks [s], fastest block and half of the blocks.

    Collective.
    """
    n, rank = sizes.neighbour // 8, comm.rank
    requests = []
    for other in (rank - 1, rank + 1):
        if 0 <= other < comm.size:
            requests.append(comm.Recv_init(np.zeros(n), source=other))
            requests.append(comm.Send_init(np.zeros(n), dest=other))
    share, reply = np.zeros(sizes.share // 8), np.zeros(sizes.reply // 8)
    summed = np.zeros_like(share) if rank == 0 else None

    def exchange() -> None:
        if requests:
            MPI.Prequest.Startall(requests)
            MPI.Request.Waitall(requests)
        comm.Reduce(share, summed, op=MPI.SUM, root=0)
        comm.Bcast(reply, root=0)

    comm.Barrier()
    found = _fastest(exchange)
    for request in requests:
        request.Free()
    return found


def _fastest(work: Callable[[], None]) -> tuple[float, float]:
    """Time of ``work`` [s], in the fastest block and in half of the blocks."""
    times = []
    for _ in range(BLOCKS):
        begin = time.perf_counter()
        for _ in range(EXCHANGES):
            work()
        times.append((time.perf_counter() - begin) / EXCHANGES)
    return min(times), float(np.median(times))
