"""Loads in time on what a rank solves for, memory of ends among them, as a step adds them.

The ends of a line that goes on remember all past accelerations there. A force
-sum over j of Q_j b_(n-j) grows with each step if it is summed anew. Of the sum, lags below
``NEAR`` are summed as they are, and those of [L, 2 L), for L = ``NEAR`` and its doubles, once for
each L steps, for L past steps and 2 L coming ones at once, by Fourier transforms (W. G. Gardner, J.
Audio Eng. Soc. 43, 1995): log(n)^2 numbers a step, and each is there when its step comes.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy import sparse

from catenary.base.errors import InputError
from catenary.base.mpi import MPI
from catenary.solver.integrators.line_state import AlphaAhead, LineState
from catenary.solver.kernels import aligned_arrays, native
from catenary.solver.linear.line_products import Subdomain
from catenary.solver.model.loads import (
    CONSTANT,
    FieldLoad,
    FunctionLoad,
    Load,
    MemoryLoad,
    ShapeLoad,
)

# Lags below this are summed one by one; a power of two.
NEAR = native.NEAR
# Size of the samples of a load [B], and the most slices that are made at once.
_BYTES, _MOST_SLICES = 2**24, 512


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


class LineLoads:
    """Forces on all unknowns that a rank solves for. Collective to make; each rank finds its own.

    Forces on held unknowns are left out.

    Parameters
    ----------
    loads : of the model, the same on all ranks
    domain : range that the rank solves for
    held : numbers of held unknowns
    comm : mpi4py communicator of the ranks that the line is on

    Attributes
    ----------
    memories : of ends that go on, None if there are none
    values : (domain.size,) their sum at the latest time [N], [N m]
    changes : whether they change with time
    arguments : of the kernel that fills ``values``, once its clock is set and the
        time is ``cover``ed
    """

    def __init__(
        self,
        loads: Sequence[Load],
        domain: Subdomain,
        held: np.ndarray,
        comm: Any = MPI.COMM_SELF,
    ) -> None:
        self.values = aligned_arrays.zeros(domain.size, 1)
        free = np.ones(domain.size, dtype=bool)
        free[held[(held >= domain.low) & (held < domain.high)] - domain.low] = False
        constant = np.zeros(domain.size)
        shapes: list[tuple[ShapeLoad, np.ndarray, np.ndarray]] = []
        self._sampled: list[_Sampled] = []
        memories = [load for load in loads if isinstance(load, MemoryLoad)]
        self.memories = EndMemories(comm, memories, domain, self.values) if memories else None
        for load in loads:
            if isinstance(load, MemoryLoad):
                continue
            here = (load.unknowns >= domain.low) & (load.unknowns < domain.high)
            mine = np.flatnonzero(here)
            mine = mine[free[load.unknowns[mine] - domain.low]]
            places = load.unknowns[mine] - domain.low
            if not isinstance(load, ShapeLoad):
                if mine.size:
                    self._sampled.append(_Sampled(load, mine, places))
            elif load.factor.kind == CONSTANT:
                np.add.at(constant, places, load.factor.numbers[0] * load.forces[mine])
            else:
                shapes.append((load, places, load.forces[mine]))
        self.values[:] = constant
        sampled = _side_by_side(self._sampled)
        remembered = np.zeros(0, np.int64) if self.memories is None else self.memories.places
        changing = _changing_of(shapes, np.concatenate([sampled.places, remembered]))
        self.changes = bool(changing.places.size)
        self.arguments = native.Loads(
            np.zeros(1), self.values, constant, changing, sampled, NO_MEMORIES
        )
        self.read(None)

    def read(self, motion: LineState | None) -> None:
        """Set the motion that forces with memory read. Not collective."""
        if self.memories is not None:
            self.memories.read(motion)
            self.arguments = self.arguments._replace(memories=self.memories.arguments)
        self._evaluate = native.evaluate.bound(self.arguments) if self.changes else None

    def at(self, time: float) -> None:
        """Make ``values`` those at a time [s]. Collective with forces that remember a motion."""
        if self._evaluate is not None:
            self.cover(np.array([time]))
            self.arguments.clock[0] = time
            self._evaluate()
        if self.memories is not None:
            self.memories.share()

    @property
    def are_sampled(self) -> bool:
        """Whether some are made ahead of their times, slice by slice."""
        return bool(self._sampled)

    def cover(self, times: np.ndarray) -> int:
        """Make ready for ascending ``times`` (n,) [s]; how many of them are, one at least."""
        return min((sampled.cover(times) for sampled in self._sampled), default=times.size)


class _Sampled:
    """A load whose forces on a rank's unknowns are made ahead, slice by slice.

    Attributes
    ----------
    places : (n,) among the unknowns that the rank solves for
    times : (most,) of slices [s]
    samples : (most, n) forces [N], [N m]
    held : (1,) how many of them are filled
    """

    def __init__(
        self, load: FieldLoad | FunctionLoad, mine: np.ndarray, places: np.ndarray
    ) -> None:
        self._load, self._mine, self.places = load, mine, places.astype(np.int64)
        most = max(3, min(_MOST_SLICES, _BYTES // (8 * places.size)))
        self.times, self.samples = np.zeros(most), np.zeros((most, places.size))
        self.held = np.zeros(1, dtype=np.int64)
        self._first = 0
        if isinstance(load, FieldLoad):
            weights = load.weights.tocsr()[mine]
            used = np.unique(weights.indices)
            low, high = (int(used[0]), int(used[-1]) + 1) if used.size else (0, 0)
            self._points, self._weights = slice(low, high), weights[:, low:high]

    def cover(self, times: np.ndarray) -> int:
        """As ``LineLoads.cover``."""
        if isinstance(self._load, FieldLoad):
            return self._cover_between(self._load, times)
        held = self.times[: self.held[0]]
        at = int(np.searchsorted(held, times[0]))
        n = min(held.size - at, times.size)
        if n == 0 or not np.array_equal(held[at : at + n], times[:n]):
            n = self._call(self._load, times)
        return n

    def _call(self, load: FunctionLoad, times: np.ndarray) -> int:
        """Call a function at as many times as there is room for."""
        n = min(times.size, self.times.size)
        self.held[0] = 0
        for i, time in enumerate(times[:n].tolist()):
            try:
                values = np.asarray(load.values(time), dtype=float)
            except Exception:
                if i == 0:
                    raise
                return i  # the steps before it are good
            self.times[i], self.samples[i] = time, values[self._mine]
            self.held[0] = i + 1
        return n

    def _cover_between(self, load: FieldLoad, times: np.ndarray) -> int:
        """Fill slices around as many times as there is room for."""
        wanted = np.floor(times / load.interval).astype(np.int64)
        low, most = int(wanted[0]), self.times.size
        need = min(int(wanted[-1]) + 2 - low, most)
        held, first = int(self.held[0]), self._first
        if not first <= low or low + need > first + held:
            # Slices that are there already, and the rest up to the most.
            kept = max(0, first + held - low) if first <= low else 0
            self.samples[:kept] = self.samples[held - kept : held].copy()
            field = np.empty((most - kept, self._points.stop - self._points.start))
            load.fill(low + kept, self._points, field)
            self.samples[kept:] = (self._weights @ field.T).T
            self._first = low
            self.held[0] = most
            self.times[:] = load.interval * np.arange(low, low + most)
        end = self._first + int(self.held[0])
        return int(np.searchsorted(wanted, end - 1))


def _changing_of(
    shapes: list[tuple[ShapeLoad, np.ndarray, np.ndarray]], others: np.ndarray
) -> native.Changing:
    """Sparse table of the forces of ``shapes``, each with its places and forces there; ``others``
    are further places that change."""
    at = np.concatenate([np.zeros(0, np.int64), *(places for _, places, _ in shapes)])
    term = np.repeat(np.arange(len(shapes)), [places.size for _, places, _ in shapes])
    forces = np.concatenate([np.zeros(0), *(values for _, _, values in shapes)])
    places = np.unique(np.concatenate([at, others])).astype(np.int64)
    matrix = sparse.coo_matrix(
        (forces, (np.searchsorted(places, at), term)), shape=(places.size, len(shapes))
    ).tocsr()
    begins, terms = matrix.indptr.astype(np.int64), matrix.indices.astype(np.int64)
    numbers = [load.factor.numbers for load, _, _ in shapes]
    ends = np.cumsum([0, *(own.size for own in numbers)])
    factors = np.zeros(len(shapes), dtype=native.FACTOR)
    factors["kind"] = [load.factor.kind for load, _, _ in shapes]
    factors["begin"], factors["end"] = ends[:-1], ends[1:]
    all_numbers = np.concatenate([np.zeros(0), *numbers])
    return native.Changing(places, begins, terms, matrix.data, factors, all_numbers)


def _side_by_side(loads: list[_Sampled]) -> native.Sampled:
    """All of them, in arrays that each then works in."""
    places = np.concatenate([np.zeros(0, np.int64), *(load.places for load in loads)])
    times = np.concatenate([np.zeros(0), *(load.times for load in loads)])
    samples = np.zeros(sum(load.samples.size for load in loads))
    table = np.zeros(len(loads), dtype=native.SAMPLED_LOAD)
    place = begin = at = 0
    for number, load in enumerate(loads):
        table[number] = place, place + load.places.size, begin, at, 0
        shape, size = load.samples.shape, load.samples.size
        load.times = times[begin : begin + load.times.size]
        load.samples = samples[at : at + size].reshape(shape)
        load.held = table["held"][number : number + 1]
        place, begin, at = place + load.places.size, begin + load.times.size, at + size
    return native.Sampled(table, times, places, samples)
