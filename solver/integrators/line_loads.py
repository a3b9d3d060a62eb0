"""Loads in time on what a rank solves for, as the pass forth of a step adds them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy import sparse

from catenary.base.mpi import MPI
from catenary.solver.integrators.end_memory import NO_MEMORIES, EndMemories
from catenary.solver.integrators.line_state import LineState
from catenary.solver.kernels import aligned_arrays, native
from catenary.solver.linear.halo import Subdomain
from catenary.solver.model.loads import (
    CONSTANT,
    FieldLoad,
    FunctionLoad,
    Load,
    MemoryLoad,
    ShapeLoad,
)

# Size of the samples of a load [B], and the most slices that are made at once.
_BYTES, _MOST_SLICES = 2**24, 512


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
