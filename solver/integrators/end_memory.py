"""Memory of the ends of a line: sums over all past accelerations there, at the cost of few.

A force -sum over j of Q_j b_(n-j) grows with each step if it is summed anew. Of the sum, lags below
``NEAR`` are summed as they are, and those of [L, 2 L), for L = ``NEAR`` and its doubles, once for
each L steps, for L past steps and 2 L coming ones at once, by Fourier transforms (W. G. Gardner, J.
Audio Eng. Soc. 43, 1995): log(n)^2 numbers a step, and each is there when its step comes.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from catenary.base.errors import InputError
from catenary.base.mpi import MPI
from catenary.solver.integrators.line_state import AlphaAhead, LineState
from catenary.solver.kernels import native
from catenary.solver.linear.halo import Subdomain
from catenary.solver.model.loads import MemoryLoad

# Lags below this are summed one by one; a power of two.
NEAR = native.NEAR


class EndMemories:
    """The memories of a line's ends, as far as a rank owns them. Collective to make and to share.

    Attributes
    ----------
    places : (k,) among what the rank solves for, where its own memories act
    arguments : of the kernels, for the arrays of a motion

    Parameters
    ----------
    comm : mpi4py communicator
    loads : of the model, the same on all ranks
    domain : range that the rank solves for
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
        self._all, self._mine = list(loads), mine
        self.places = np.concatenate(
            [np.zeros(0, np.int64), *(load.unknowns - domain.low for load in mine)]
        )
        self._tables = tables_of([(load.numbers(load.n_steps + 1), load.dt) for load in mine])
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
        self.arguments = native.Memories(*places, latest, known, shares, self._tables)

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
        native.recall(self._tables, n)

    def destroy(self) -> None:
        """Free the messages."""
        for request in self._requests:
            request.Free()
        self._requests = []

    def _past_of(self, number: int) -> np.ndarray:
        """Rows of one of the rank's own ends, the array itself."""
        end = self._tables.ends[number]
        m, n, at = end["width"], end["n_steps"], end["past"]
        return self._tables.past[at : at + m * n].reshape(m, n)

    def _connect(self, domain: Subdomain, owns: list[bool]) -> None:
        """Set up messages from owners to others that solve for an end. Collective."""
        comm = self._comm
        if comm.size == 1 or not self._all:
            return
        parts = comm.allgather((domain.low, domain.high, owns))
        for number, load in enumerate(self._all):
            low, high = int(load.unknowns.min()), int(load.unknowns.max())
            places = load.unknowns - domain.low
            for rank, (its_low, its_high, its_own) in enumerate(parts):
                if rank == comm.rank or not (owns[number] or its_own[number]):
                    continue
                buffer = np.zeros(load.unknowns.size)
                if owns[number] and its_low <= low and high < its_high:
                    self._sent.append((places, buffer))
                    self._requests.append(comm.Send_init(buffer, dest=rank, tag=number))
                elif its_own[number] and domain.low <= low and high < domain.high:
                    self._taken.append((places, buffer))
                    self._requests.append(comm.Recv_init(buffer, source=rank, tag=number))


def tables_of(ends: list[tuple[np.ndarray, float]]) -> native.MemoryTables:
    """Tables of ends with numbers Q (n, m, m) of all lags, and the time step [s] of each."""
    table = np.zeros(len(ends), dtype=native.END_MEMORY)
    near, spectra = [np.zeros(0)], [np.zeros(0, dtype=complex)]
    sizes = np.zeros(4, dtype=np.int64)
    largest = max((_levels_of(numbers.shape[0]) for numbers, _ in ends), default=0)
    longest = NEAR << max(largest - 1, 0)
    turns = np.ones(2 * longest, dtype=complex)
    half = 1
    while half <= longest:
        turns[half : 2 * half] = np.exp(-1j * np.pi * np.arange(half) / half)
        half *= 2
    widest = 0
    for e, (numbers, dt) in enumerate(ends):
        n, m, _ = numbers.shape
        levels = _levels_of(n)
        widest = max(widest, m)
        table[e] = m, n, levels, *sizes, 0, dt
        padded = np.zeros((NEAR << levels, m, m))
        padded[: min(n, NEAR << levels)] = numbers[: NEAR << levels]
        padded[0] = 0.0
        near.append(padded[:NEAR].transpose(1, 2, 0).ravel())
        size = 0
        for level in range(levels):
            length = NEAR << level
            part = np.zeros((m, m, 2 * length))
            part[:, :, :length] = padded[length : 2 * length].transpose(1, 2, 0)
            paired = part[0::2].astype(complex)
            paired[: m // 2] += 1j * part[1::2]
            for row in paired.reshape(-1, 2 * length):
                native.fourier_forth(row, turns)
            # The transform back is divided here.
            spectra.append(paired.ravel() / (2 * length))
            size += paired.size
        sizes += (m * n, m * n, near[-1].size, size)
    room = np.zeros((widest + 1, turns.size), dtype=complex)
    past, sums = np.zeros(sizes[0]), np.zeros(sizes[1])
    return native.MemoryTables(
        table, past, sums, np.concatenate(near), np.concatenate(spectra), room, turns
    )


def _levels_of(n: int) -> int:
    """Doubles of NEAR, itself included, that are lags of n steps."""
    levels = 0
    while NEAR << levels < n:
        levels += 1
    return levels


def _none() -> native.Memories:
    nowhere, nothing = np.zeros(0, dtype=np.int64), np.zeros(0)
    return native.Memories(nowhere, nowhere, nothing, nothing, np.array([1.0, 0.0]), tables_of([]))


# ``EndMemories.arguments`` of a line without memories.
NO_MEMORIES = _none()
