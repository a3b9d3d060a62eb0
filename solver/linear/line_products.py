"""The part of the line that a rank computes on: what its neighbours send, products with M, K and C.

Products are made by stations or by PETSc.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from catenary.base.mpi import MPI
from catenary.base.petsc import PETSc
from catenary.solver.linear.pieces import OperatorPieces
from catenary.solver.linear.station_products import (
    Layout,
    StationProduct,
    joining,
    layout_of,
    of_pairs,
    station_product,
    with_damping,
)
from catenary.solver.linear.station_rows import LikeRows, LikeStations, Sections, StationRows
from catenary.solver.model.matrices import as_petsc, part_of
from catenary.solver.model.model import Model
from catenary.solver.model.partition import Ownership

_COEFFICIENTS = {
    "mass": (1.0, 0.0, 0.0),
    "stiffness": (0.0, 1.0, 0.0),
    "damping": (0.0, 0.0, 1.0),
}
# Products of each vector that a row of M is to have less than one of K to take its place.
FEWER = 1.5


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


class LineProducts:
    """Products with M, K and C, each made at its first use. Not collective.

    Parameters
    ----------
    model : Model
    domain : Subdomain, whose rows are multiplied
    like : marks of the line's stations, None with ``in_pieces``
    padded : operand of products by stations, with one more station at both ends
    read : PETSc vector of the same memory without these two stations
    in_pieces : maker of products of a part of the line, None for products of all of it

    Attributes
    ----------
    layout : how unknowns of a station stand in lanes; None until it is found, or if they cannot
    """

    def __init__(
        self,
        model: Model,
        domain: Subdomain,
        padded: np.ndarray,
        read: PETSc.Vec,
        like: LikeStations | None,
        in_pieces: OperatorPieces | None = None,
    ) -> None:
        self._model, self._domain, self._padded, self._read = model, domain, padded, read
        self._like, self._in_pieces = like, in_pieces
        self.layout: Layout | None = None if in_pieces is None else in_pieces.layout
        self._rows: dict[str, StationRows] = {}  # kept until products are made
        self._matrices: dict[str, PETSc.Mat] = {}
        self._products: dict[str, StationProduct | None] = {}

    def prepare(self) -> None:
        """Make the products that steps and energies need, before the first of them."""
        for name in ("stiffness", "mass"):
            self.by_stations(name)
        self._rows.clear()

    def destroy(self) -> None:
        """Free all PETSc objects."""
        for matrix in self._matrices.values():
            matrix.destroy()

    def _matrix(self, name: str) -> PETSc.Mat:
        """M, K or C for the rows of the subdomain."""
        if name not in self._matrices:
            domain = self._domain
            part = part_of(
                self._model,
                (domain.low, domain.high),
                (domain.read_low, domain.read_high),
                _COEFFICIENTS[name],
                0.0,
                self._model.numbering.block,
            )
            self._matrices[name] = as_petsc(part, PETSc.COMM_SELF)
        return self._matrices[name]

    def multiply(self, name: str, result: np.ndarray, wrapped: PETSc.Vec) -> None:
        """Write the product of M, K or C, by ``name``, with ``read`` to ``result``; ``wrapped`` is
        the PETSc vector of the same memory."""
        by_stations = self.by_stations(name)
        if by_stations is not None:
            by_stations.multiply(self._padded, result)
        elif self._domain.size:
            self._matrix(name).mult(self._read, wrapped)

    def by_stations(self, name: str, damped: bool = False) -> StationProduct | None:
        """The product with M, K or C by stations; None if there is none. A ``damped`` one subtracts
        a product with C."""
        key = f"damped {name}" if damped else name
        if key not in self._products and self._in_pieces is not None:
            damping = _COEFFICIENTS["damping"] if damped else None
            self._products[key] = self._in_pieces.product(_COEFFICIENTS[name], damping)
        if key not in self._products:
            rows = None
            if self.layout is not None and self._domain.size:
                rows = self._rows_of(name)
            self._products[key] = None if rows is None else self._product(rows, damped)
        return self._products[key]

    def of_operator(self, operator: StationRows) -> StationProduct | None:
        """The product with the operator that is solved with, by its rows."""
        assert self.layout is not None
        rows = self._sections(self._domain.low, self._domain.high)
        return station_product(operator, 0, self.layout, rows)

    def _product(self, rows: StationRows, damped: bool) -> StationProduct | None:
        assert self.layout is not None
        (columns, first), layout, damping = self._columns(), self.layout, None
        if damped:
            damping = self._rows_of("damping")
            layout = with_damping(layout, None if damping is None else damping.blocks)
        return station_product(rows, first, layout, columns, damping)

    def instead_of_stiffness(self, mass: float, stiffness: float) -> StationProduct | None:
        """The product with P = -(``mass`` / ``stiffness``) M, where A = ``mass`` M + ``stiffness``
        K, so that A^-1 K x = x / ``stiffness`` + A^-1 P x; None unless it is the shorter way.

        M joins a wire's own unknowns of one plane, whatever K joins, and is the same in all
        elements of a length.
        """
        if self.layout is None or not self._domain.size:
            return None
        rows = self._rows_of("mass")
        if rows is None:
            return None
        rows = rows._replace(blocks=-mass / stiffness * rows.blocks)
        pairs = of_pairs(self.layout.pitch)
        layout = joining(replace(self.layout, own=pairs, beside=pairs), rows.blocks)
        found, of_stiffness = layout.native, self.layout.native
        if found.n_products + FEWER * found.n_vectors > of_stiffness.n_products:
            return None
        columns, first = self._columns()
        return station_product(rows, first, layout, columns)

    def find_layout(self, coefficients: tuple[float, float, float]) -> StationRows | None:
        """Find how unknowns of a station stand in lanes, if they can, from K and from the operator
        with these ``coefficients`` of M, K and C. Only where nodes form stations.

        Returns rows of the operator, None if there is no layout.
        """
        domain = self._domain
        rows = self._sections(domain.low, domain.high)
        operator = self._like_rows.sums_of([coefficients], (domain.low, domain.high), [1.0])
        names = ("stiffness", "mass")
        read = domain.read_low, domain.read_high
        found = self._like_rows.sums_of([_COEFFICIENTS[name] for name in names], read, (0.0, 0.0))
        if operator is None or found is None:
            return None
        self._rows = dict(zip(names, found, strict=True))
        station_types = rows.station_types if rows.varies else ()
        self.layout = layout_of(operator[0].blocks, self._rows["stiffness"].blocks, station_types)
        return operator[0] if self.layout is not None else None

    @cached_property
    def _like_rows(self) -> LikeRows:
        assert self._like is not None
        return LikeRows(self._model, self._like, self._domain.low, self._domain.high)

    def _sections(self, low: int, high: int) -> Sections:
        return Sections.of(self._model.numbering, low, high)

    def _columns(self) -> tuple[Sections, int]:
        """Stations that products read, and which of them is the first that is solved for."""
        domain = self._domain
        columns = self._sections(domain.read_low, domain.read_high)
        return columns, int(np.searchsorted(columns.starts, domain.low - domain.read_low))

    def _rows_of(self, name: str) -> StationRows | None:
        if name in self._rows:
            return self._rows[name]
        read = self._domain.read_low, self._domain.read_high
        found = self._like_rows.sums_of([_COEFFICIENTS[name]], read, [0.0])
        return None if found is None else found[0]
