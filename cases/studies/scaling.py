"""Latency and bandwidth of messages between ranks, measured, and steps on many ranks with them."""

from __future__ import annotations

import math
import timeit
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from catenary.base.mpi import MPI
from catenary.base.parallel import wait_for_all
from catenary.cases.run.cluster import Sizes, Wire, Work, predict
from catenary.postproc.report.study_table import Column, StudyTable

# Sizes of messages that latency and bandwidth are found from [B].
SIZES = (8, 512, 4096, 32768, 262144)
# Blocks of exchanges, of which the fastest counts, and exchanges in each.
BLOCKS, EXCHANGES = 25, 20


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
    times = np.array(timeit.repeat(work, repeat=BLOCKS, number=EXCHANGES)) / EXCHANGES
    return float(times.min()), float(np.median(times))


MOST_RANKS = 1_000_000
# Times in the table of a prediction, and their heads.
_PARTS = (("step", "us a step"), ("line", "line"), ("neighbours", "neighbours"), ("tree", "tree"),
          ("fixed", "rank 0"))  # fmt: skip


def as_text(
    work: Work,
    wire: Wire,
    ranks: Sequence[int],
    measured_wire: bool,
    exchange: tuple[int, float, float] | None,
) -> str:
    """The prediction for a terminal.

    Parameters
    ----------
    work : of a step
    wire : latency and bandwidth of messages
    ranks : numbers of ranks
    measured_wire : whether latency and bandwidth are measured between ranks 0 and 1
    exchange : number of ranks that there are, and times of a step's messages on them as
        `time_of_exchange` gives them [s]; None on one rank
    """
    speed = 1e-9 / wire.per_byte if wire.per_byte > 0.0 else math.inf
    how = "between ranks 0 and 1 of this machine" if measured_wire else "as given"
    lines = [
        f"{work.spans} spans, {work.unknowns} unknowns: {1e6 * work.step:.0f} us a step on one "
        "rank (estimate of plan)",
        f"a message takes {1e6 * wire.latency:.2f} us and {speed:.3g} GB/s ({how}); a rank sends "
        f"{work.sizes.neighbour} B to each neighbour and {work.sizes.share} B to rank 0, which "
        f"answers with {work.sizes.reply} B",
        "",
    ]
    one = predict(work, wire, 1).step
    found = [predict(work, wire, number) for number in ranks]
    rows = [
        {"ranks": own.ranks, "efficiency": 100.0 * one / (own.ranks * own.step)}
        | {name: 1e6 * getattr(own, name) for name, _ in _PARTS}
        for own in found
    ]
    columns = [Column("ranks", "ranks", "d"), *(Column(*names, ".1f") for names in _PARTS)]
    columns.append(Column("efficiency", "efficiency [%]", ".3g"))
    lines.append(StudyTable(columns, rows).text())
    if exchange is not None:
        there, fastest, half = exchange
        expected = 1e6 * predict(work, wire, there).messages
        lines += [
            "",
            f"measured, all messages of a step on the {there} ranks that there are: "
            f"{1e6 * fastest:.1f} us at best, {1e6 * half:.1f} us in half of the blocks; predicted "
            f"with a core for each: {expected:.1f} us",
        ]
    return "\n".join(lines)
