"""Time of a step on many ranks: the line shared out, and messages by latency and bandwidth.

A step on p ranks of a line of n unknowns, c [s] each, takes

    t(p) = t0 + c (n / p + 2 o) + 2 m(o) + log2(p) (m(share) + m(reply)),   p > 1,

with t0 for contacts, pantographs and steps taken one by one on rank 0, o unknowns of overlap to
each of two neighbours, m(k) = latency + k / bandwidth. Reductions and broadcasts run over a tree.
"""

from __future__ import annotations

import math
import timeit
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from catenary.base.mpi import MPI
from catenary.base.parallel import wait_for_all
from catenary.cases.run.planning.needs import needs_with_mesh
from catenary.cases.run.scene_mesh import mesh_of
from catenary.cases.scene.cost_model import STEP_OVERHEAD
from catenary.cases.scene.problem import problem_of
from catenary.cases.scene.scene import Scene
from catenary.postproc.report.study_table import Column, StudyTable
from catenary.solver.effects.build_model import numbering_of

# Sizes of messages that latency and bandwidth are found from [B].
SIZES = (8, 512, 4096, 32768, 262144)
# Blocks of exchanges, of which the fastest counts, and exchanges in each.
BLOCKS, EXCHANGES = 25, 20


class Wire(NamedTuple):
    """Time of a message: ``latency`` [s] and ``per_byte`` [s/B]."""

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
    times = np.array(timeit.repeat(work, repeat=BLOCKS, number=EXCHANGES)) / EXCHANGES
    return float(times.min()), float(np.median(times))


# Bytes of a number; numbers before the answers in a share, before the forces in a reply, and links
# with their compensations that a reply has room for.
_BYTES, _FLAGS, _HEAD, _LINKS = 8, 4, 4, 32
MOST_RANKS = 1_000_000
# Times in the table of a prediction, and their heads.
_PARTS = (("step", "us a step"), ("line", "line"), ("neighbours", "neighbours"), ("tree", "tree"),
          ("fixed", "rank 0"))  # fmt: skip
# Time that a step takes longer by itself, as on several ranks, than in a block of steps: measured
# on lines of 25 to 1000 spans before and after there were blocks [s].
_ONE_BY_ONE = 1e-5


class Work(NamedTuple):
    """A step on one rank.

    Attributes
    ----------
    unknowns, spans : of the line
    step : time of a step on one rank [s]
    fixed : part of it that does not grow with the length of the line [s]
    sizes : of messages on several ranks
    """

    unknowns: int
    spans: int
    step: float
    fixed: float
    sizes: Sizes

    @property
    def overlap(self) -> float:
        """Unknowns that a rank solves for beyond its own to each side: about a span."""
        return self.unknowns / self.spans


class Predicted(NamedTuple):
    """A step on a number of ranks: whole, and its parts [s]."""

    ranks: int
    line: float
    neighbours: float
    tree: float
    fixed: float

    @property
    def step(self) -> float:
        """All of it [s]."""
        return self.line + self.neighbours + self.tree + self.fixed

    @property
    def messages(self) -> float:
        """Share of the messages [s]."""
        return self.neighbours + self.tree


def work_of(scene: Scene) -> Work:
    """Work of a step of a scene: its time on one rank, by the estimate of ``catenary plan``, and
    its messages on several. Not collective."""
    problem, mesh = problem_of(scene), mesh_of(scene)
    needs = needs_with_mesh(scene, mesh)
    n_unknowns, n_spans = numbering_of(problem, mesh).n_unknowns, problem.line.n_spans
    contacts = sum(len(place.data.strips.offsets) for place in problem.train.placements)
    share = _FLAGS + 2 * contacts * (1 + contacts)
    reply = _HEAD + contacts + 2 * _LINKS
    sizes = Sizes(_BYTES * math.ceil(n_unknowns / n_spans), _BYTES * share, _BYTES * reply)
    step = needs.march / needs.n_steps
    return Work(n_unknowns, n_spans, step, min(STEP_OVERHEAD, step), sizes)


def predict(work: Work, wire: Wire, ranks: int) -> Predicted:
    """Predicted time of a step on ``ranks`` ranks, each with a core of its own.

    ``work`` is that of a step of the march, ``wire`` the cost of messages.
    """
    each = (work.step - work.fixed) / work.unknowns
    if ranks == 1:
        return Predicted(1, each * work.unknowns, 0.0, 0.0, work.fixed)
    sizes, levels = work.sizes, math.log2(ranks)
    return Predicted(
        ranks,
        each * (work.unknowns / ranks + 2.0 * work.overlap),
        2.0 * wire.message(sizes.neighbour),
        levels * (wire.message(sizes.share) + wire.message(sizes.reply)),
        work.fixed + _ONE_BY_ONE,
    )


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
