"""The step's messages: every rank's share of the inner problem to rank 0, the forces back.

Python takes named views of the numbers that a rank sends of the line's side.

One reduction to rank 0 and one broadcast of fixed size a step, whatever the number of ranks; what
a rank sends besides are rows of links that may switch, if it owns any. Both also carry the wish
to stop and the news of a failure, so that all ranks leave the loop at the same step.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Any, NamedTuple

import numpy as np

from catenary.base.mpi import MPI
from catenary.base.petsc import event
from catenary.mbs.interface import affine
from catenary.solver.kernels import native
from catenary.solver.kernels.native import FLAGS, Bounds, LinkRows, Share

_FIRST_CAPACITY = 32
# Numbers before the forces in a reply, and the tag of rows.
_HEAD, _ROWS = 4, 7
_NO_NUMBERS, _NO_FORCES = np.zeros(0, dtype=np.int64), np.zeros(0)
# Numbers that add up over ranks besides answers.
N_FLAGS = FLAGS.itemsize // 8


class LineResponse:
    """Answers of the line to n contacts, and a row for each link that may switch.

    Attributes
    ----------
    summed : everything that adds up over ranks, in one array
    line : Affine, free heights [m] and total rates [m/s] of the wire at the contacts; its views
    present : (n,) 1 for contacts whose wire is on the strip, else 0; the same on all ranks
    early_height, early_rate : (n,) wire heights [m] and rates [m/s] extrapolated from the line's
        motion; (0,) without ``early``
    rows : ``native.LinkRows``, whose ``numbers`` (capacity, 2 + 3 n) are sent
    arrays : Share, all this as kernels take it
    bounds : Bounds; kept by reference

    Parameters
    ----------
    n_contacts, capacity : number of contacts, and of links that have room
    early : whether there is room for extrapolated heights and rates
    bounds : unlimited if not given
    """

    def __init__(
        self,
        n_contacts: int,
        capacity: int,
        early: bool = False,
        bounds: Bounds | None = None,
    ) -> None:
        n, n_early = n_contacts, n_contacts if early else 0
        self.n_contacts, self.capacity = n, capacity
        sizes = (N_FLAGS, 2 * n * (1 + n), n_early, n_early)
        self.summed = np.zeros(sum(sizes))
        flags, answers, self.early_height, self.early_rate = np.split(
            self.summed, np.cumsum(sizes)[:-1]
        )
        self.line = affine(answers, n)
        self.rows = LinkRows(np.zeros((capacity, 2 + 3 * n)))
        self.present = np.ones(n)
        self.bounds = bounds or Bounds(*(np.full(size, np.inf) for size in (n, n, 1)))
        self.arrays = Share(flags.view(FLAGS), self.present, self.line, self.rows, self.bounds)

    @property
    def count(self) -> int:
        """Number of links that may switch and have a row."""
        return int(self.summed[0])

    @count.setter
    def count(self, count: int) -> None:
        self.summed[0] = count

    @property
    def flags(self) -> tuple[float, float, float, float]:
        """Number of links with a row, and over all ranks: whether one ends the march with this
        step, whether one holds NaN or infinity, and the number of links without room."""
        count, stop, broken, missing = self.summed[:N_FLAGS].tolist()
        return count, stop, broken, missing

    def put_stop(self, stop: bool) -> None:
        """Set whether this rank ends the march with this step."""
        self.summed[1] = stop

    @property
    def links(self) -> np.ndarray:
        """Numbers of the links with a row (m,)."""
        return self.rows.numbers[: self.count, 0].astype(np.int64)


class Verdict(IntEnum):
    """Message of rank 0 to the others after the inner problem."""

    ADVANCE = 0
    ADVANCE_AND_STOP = 1
    REPEAT = 2
    ENLARGE = 3
    BROKEN = 4
    REJECT = 5


class Reply(NamedTuple):
    """Rank 0's answer: verdict, contact forces (n,) [N], switched links and compensations [N].

    ``room`` is how many links a rank needs room for, with the verdict ``ENLARGE``; ``level`` is
    that of the next step, where steps adapt.
    """

    verdict: Verdict
    contact_force: np.ndarray
    links: np.ndarray = _NO_NUMBERS
    compensation: np.ndarray = _NO_FORCES
    room: int = 0
    level: int = 0


class Exchange:
    """Sums up and broadcasts for ``n_contacts``. All methods are collective.

    Attributes
    ----------
    share : this rank's share of the inner problem, to be filled in before ``to_root``
    messages, bytes_sent : number of messages and bytes that this rank has sent since the exchange
        was made; a sum or broadcast counts as one message

    Parameters
    ----------
    early : whether shares hold heights and rates extrapolated from the line's motion
    bounds : of all shares, see ``LineResponse``
    """

    def __init__(self, comm: Any, n_contacts: int, early: bool, bounds: native.Bounds) -> None:
        self._comm = comm
        self._n = n_contacts
        self._early, self._bounds = early, bounds
        self.messages = self.bytes_sent = 0
        self._reduce, self._reply = event("ContactReduce"), event("ContactReply")
        self.enlarge(_FIRST_CAPACITY)

    def enlarge(self, capacity: int) -> None:
        """Make room for at least ``capacity`` links a rank."""
        n = self._n
        self.share = LineResponse(n, capacity, self._early, self._bounds)
        self._merged = LineResponse(n, capacity, self._early, self._bounds)
        self._answer = np.zeros(_HEAD + n + 2 * capacity)
        # Messages with their length and type set in advance cost half a microsecond less.
        self._answer_message = _message(self._answer)
        self._sums = _message(self.share.summed), _message(self._merged.summed)

    def to_root(self) -> LineResponse | None:
        """Sum of all shares on rank 0, with the rows of all; None elsewhere."""
        comm, share = self._comm, self.share
        if comm.size == 1:
            return share
        is_root = comm.rank == 0
        self._reduce.begin()
        # Two ranks at most own the ends of an element: the order of summing does not matter.
        mine, all_together = self._sums
        self._merged.present[:] = share.present
        comm.Reduce(mine, all_together if is_root else None, op=MPI.SUM, root=0)
        self._count(share.summed.nbytes)
        if not is_root:
            if share.count:
                rows = share.rows.numbers[: share.count]
                comm.Send(rows, dest=0, tag=_ROWS)
                self._count(rows.nbytes)
        else:
            self._receive_rows()
        self._reduce.end()
        return self._merged if is_root else None

    def from_root(self, reply: Reply | None) -> Reply:
        """Rank 0's reply on all ranks; None is passed elsewhere."""
        comm, answer, n = self._comm, self._answer, self._n
        if comm.size == 1:
            assert reply is not None
            return reply
        self._reply.begin()
        room = (answer.size - _HEAD - n) // 2
        if reply is not None:
            count = reply.links.size
            # One by one: numpy takes longer over a tuple than the rest of this.
            answer[0], answer[1] = reply.verdict, count
            answer[2], answer[3] = reply.room, reply.level
            answer[_HEAD : _HEAD + n] = reply.contact_force
            if 0 < count <= room:
                answer[_HEAD + n : _HEAD + n + count] = reply.links
                answer[_HEAD + n + count : _HEAD + n + 2 * count] = reply.compensation
        comm.Bcast(self._answer_message, root=0)
        self._count(answer.nbytes)
        count = int(answer[1])
        pairs = answer[_HEAD + n : _HEAD + n + 2 * count]
        if count > room:
            # More switched links at once than a rank reports: rare, and sent in a second message.
            pairs = np.zeros(2 * count)
            if reply is not None:
                pairs[:count], pairs[count:] = reply.links, reply.compensation
            comm.Bcast(pairs, root=0)
            self._count(pairs.nbytes)
        self._reply.end()
        if reply is not None:
            return reply
        return Reply(
            Verdict(int(answer[0])),
            answer[_HEAD : _HEAD + n].copy(),
            pairs[:count].astype(np.int64),
            pairs[count : 2 * count].copy(),
            int(answer[2]),
            int(answer[3]),
        )

    def _count(self, n_bytes: int) -> None:
        self.messages += 1
        self.bytes_sent += n_bytes

    def _receive_rows(self) -> None:
        """Rows of all ranks one after the other, rank by rank."""
        comm, share, merged = self._comm, self.share, self._merged
        total = merged.count
        if total == 0:
            return
        if total > merged.capacity:
            larger = LineResponse(self._n, 2 * total, self._early, self._bounds)
            larger.summed[:], larger.present[:] = merged.summed, merged.present
            self._merged = merged = larger
            self._sums = self._sums[0], _message(larger.summed)
        end = share.count
        merged.rows.numbers[:end] = share.rows.numbers[:end]
        missing = total - end
        if not missing:
            return
        parts, status = {}, MPI.Status()
        while missing > 0:
            comm.Probe(source=MPI.ANY_SOURCE, tag=_ROWS, status=status)
            width = share.rows.numbers.shape[1]
            rows = np.empty((status.Get_count(MPI.DOUBLE) // width, width))
            comm.Recv(rows, source=status.Get_source(), tag=_ROWS)
            parts[status.Get_source()] = rows
            missing -= len(rows)
        for source in sorted(parts):
            merged.rows.numbers[end : end + len(parts[source])] = parts[source]
            end += len(parts[source])


def _message(array: np.ndarray) -> list[Any]:
    """An array as MPI takes it."""
    return [array, array.size, MPI.DOUBLE]
