"""What ends of a line remember: sums over all past accelerations there, at the cost of few.

A force -sum over j of Q_j b_(n-j) grows with each step if it is summed anew. Of the sum, lags below
``NEAR`` are summed as they are, and those of [L, 2 L), for L = ``NEAR`` and its doubles, once for
each L steps, for L past steps and 2 L coming ones at once, by Fourier transforms (W. G. Gardner, J.
Audio Eng. Soc. 43, 1995): log(n)^2 numbers a step, and each is there when its step comes.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from mpi4py import MPI

from catenary.solver.base.errors import InputError
from catenary.solver.integrators.line_state import AlphaAhead, LineState
from catenary.solver.integrators.loads import memory_kernels
from catenary.solver.linear.halo import Subdomain
from catenary.solver.model.loads import MemoryLoad


class EndMemories:
    """The memories of a line's ends, as far as a rank owns them. Collective to make and to share.

    Attributes
    ----------
    places : (k,) among what the rank solves for, where its own memories act
    arguments : of ``memory_kernels.remember`` but the first two, for the arrays of a motion

    Parameters
    ----------
    comm : mpi4py communicator
    loads : of the model, the same on all ranks
    domain : what the rank solves for
    values : (domain.size,) forces of all loads, which those of memories are among
    """

    def __init__(
        self, comm: Any, loads: Sequence[MemoryLoad], domain: Subdomain, values: np.ndarray
    ) -> None:
        self._comm, self._values = comm, values
        owns = [
            domain.first <= int(load.unknowns.min()) and int(load.unknowns.max()) < domain.last
            for load in loads
        ]
        mine = [load for load, own in zip(loads, owns, strict=True) if own]
        self._all, self._mine, self._owner = list(loads), mine, domain.first
        self.places = np.concatenate(
            [np.zeros(0, np.int64), *(load.unknowns - domain.low for load in mine)]
        )
        self._tables = memory_kernels.tables_of(
            [(load.numbers(load.n_steps + 1), load.dt) for load in mine]
        )
        self._own = self.places + domain.low - domain.first
        self.read(None)
        self._requests: list[MPI.Prequest] = []
        self._sent: list[tuple[np.ndarray, np.ndarray]] = []
        self._taken: list[tuple[np.ndarray, np.ndarray]] = []
        self._connect(domain, owns)

    def read(self, motion: LineState | None) -> None:
        """Take accelerations from a motion from now on."""
        if motion is None:
            latest, known, shares = np.zeros(0), np.zeros(0), np.array([1.0, 0.0])
        elif isinstance(motion, AlphaAhead):
            latest, known = motion.read[2], motion.known
            of_balanced, of_known = motion.balance
            shares = np.array([1.0 / of_balanced, -of_known / of_balanced])
        else:
            latest = known = motion.read[2]
            shares = np.array([1.0, 0.0])
        places = self.places.astype(np.int64), self._own.astype(np.int64)
        self.arguments = (places, (latest, known, shares), self._tables)

    def share(self) -> None:
        """Send the forces to ranks that solve for them, too. Collective among these."""
        if not self._requests:
            return
        for places, sent in self._sent:
            sent[:] = self._values[places]
        MPI.Prequest.Startall(self._requests)
        MPI.Request.Waitall(self._requests)
        for places, taken in self._taken:
            self._values[places] = taken

    def past(self) -> np.ndarray:
        """Accelerations at the ends that are remembered, (unknowns of all ends, most steps).

        Collective; the same on all ranks.
        """
        own = [self._past_of(e).copy() for e in range(len(self._mine))]
        numbers = [int(load.unknowns[0]) for load in self._mine]
        found: dict[int, np.ndarray] = {}
        for part in self._comm.allgather(dict(zip(numbers, own, strict=True))):
            found.update(part)
        return np.concatenate([found[int(load.unknowns[0])] for load in self._all])

    def recall(self, past: np.ndarray, n: int) -> None:
        """Remember the first ``n`` steps of what ``past`` has returned. Not collective.

        Raises
        ------
        InputError
            If it is not of these ends, or shorter.
        """
        sizes = [load.unknowns.size for load in self._all]
        if past.ndim != 2 or past.shape[0] != sum(sizes) or past.shape[1] < n:
            raise InputError(
                f"the past of the line's ends has the shape {past.shape} in place of "
                f"{sum(sizes)} rows of at least {n} steps"
            )
        ends = np.cumsum([0, *sizes])
        mine = {int(load.unknowns[0]): e for e, load in enumerate(self._mine)}
        for load, first, last in zip(self._all, ends[:-1], ends[1:], strict=True):
            number = mine.get(int(load.unknowns[0]))
            if number is not None:
                rows = self._past_of(number)
                rows[:] = 0.0
                rows[:, :n] = past[first:last, :n]
        memory_kernels.recall(self._tables, n)

    def destroy(self) -> None:
        """Free the messages."""
        for request in self._requests:
            request.Free()
        self._requests = []

    def _past_of(self, number: int) -> np.ndarray:
        """Rows of one of the rank's own ends, the array itself."""
        m, n, _, at = self._tables[0][number, :4]
        return self._tables[2][at : at + m * n].reshape(m, n)

    def _connect(self, domain: Subdomain, owns: list[bool]) -> None:
        """Set up messages from owners to others that solve for an end. Collective."""
        comm = self._comm
        if comm.size == 1 or not self._all:
            return
        told = comm.allgather((domain.low, domain.high, owns))
        for number, load in enumerate(self._all):
            low, high = int(load.unknowns.min()), int(load.unknowns.max())
            places = load.unknowns - domain.low
            for rank, (its_low, its_high, its_own) in enumerate(told):
                if rank == comm.rank or not (owns[number] or its_own[number]):
                    continue
                buffer = np.zeros(load.unknowns.size)
                if owns[number] and its_low <= low and high < its_high:
                    self._sent.append((places, buffer))
                    self._requests.append(comm.Send_init(buffer, dest=rank, tag=number))
                elif its_own[number] and domain.low <= low and high < domain.high:
                    self._taken.append((places, buffer))
                    self._requests.append(comm.Recv_init(buffer, source=rank, tag=number))


def _none() -> tuple[Any, ...]:
    nowhere = np.zeros(0, dtype=np.int64)
    still = np.zeros(0), np.zeros(0), np.array([1.0, 0.0])
    return (nowhere, nowhere), still, memory_kernels.tables_of([])


# What a line without memories has for ``EndMemories.arguments``.
NO_MEMORIES = _none()
