"""The part of the line that a rank computes on, and what its neighbours send."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from catenary.base.mpi import MPI
from catenary.solver.model.partition import Ownership


@dataclass(frozen=True)
class Subdomain:
    """Ranges of unknowns of one rank, each within the next.

    Attributes
    ----------
    first, last : range that the rank owns
    low, high : range that it solves for: its own, and the overlap with its neighbours
    read_low, read_high : range that products over [low, high) read
    """

    first: int
    last: int
    low: int
    high: int
    read_low: int
    read_high: int

    @property
    def size(self) -> int:
        """Number of unknowns that are solved for."""
        return self.high - self.low

    @property
    def owned(self) -> slice:
        """The rank's own unknowns among those solved for."""
        return slice(self.first - self.low, self.last - self.low)

    @property
    def owned_of_read(self) -> slice:
        """The rank's own unknowns among those read."""
        return slice(self.first - self.read_low, self.last - self.read_low)


class Halo:
    """Fills what an array holds of other ranks' unknowns. Collective to make and to use.

    The messages are set up once and go straight from array to array, each part from its owner:
    a line's ranks talk to as many neighbours as the range reaches over, two as a rule.

    Parameters
    ----------
    comm : mpi4py communicator
    ownership : Ownership
    low : number of the first unknown in ``array``
    array : of consecutive unknowns, all of this rank's own among them; kept by reference

    Attributes
    ----------
    messages, bytes_sent : that this rank sends at each exchange
    """

    def __init__(self, comm: Any, ownership: Ownership, low: int, array: np.ndarray) -> None:
        self._requests: list[MPI.Prequest] = []
        self.messages = self.bytes_sent = 0
        if comm.size == 1:
            return
        ranges = comm.allgather((low, low + array.size))
        for rank, (other_low, other_high) in enumerate(ranges):
            if rank == comm.rank:
                continue
            begin = max(low, int(ownership.bounds[rank]))
            end = min(low + array.size, int(ownership.bounds[rank + 1]))
            if begin < end:
                wanted = array[begin - low : end - low]
                self._requests.append(comm.Recv_init(wanted, source=rank))
            begin, end = max(other_low, ownership.first), min(other_high, ownership.last)
            if begin < end:
                sent = array[begin - low : end - low]
                self._requests.append(comm.Send_init(sent, dest=rank))
                self.messages += 1
                self.bytes_sent += sent.nbytes

    def exchange(self) -> None:
        """Bring the others' parts up to date."""
        if self._requests:
            MPI.Prequest.Startall(self._requests)
            MPI.Request.Waitall(self._requests)

    def destroy(self) -> None:
        """Free the messages."""
        for request in self._requests:
            request.Free()
        self._requests = []
