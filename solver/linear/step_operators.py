"""Operators of a step: products with K and C, and a solve with A.

Every rank holds the rows of its own part of the line and of its overlap with the neighbours'. One
halo exchange a step; product and solve then need no communication.
"""

from __future__ import annotations

import logging
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from scipy import sparse

from catenary.base.errors import NotConverged, RunBroken
from catenary.base.mpi import MPI
from catenary.base.petsc import PETSc, event
from catenary.solver.kernels import aligned_arrays
from catenary.solver.linear.line_products import Halo, LineProducts, Subdomain
from catenary.solver.linear.petsc_solvers import (
    DIRECT,
    PREFIX,
    PartSolver,
    SchwarzSolver,
    Wrapped,
    allows_own_factors,
    trial_load,
    wants_distributed_solver,
    wants_view,
)
from catenary.solver.linear.pieces import OperatorPieces
from catenary.solver.linear.station_factors import StationFactors, station_factors
from catenary.solver.linear.station_products import MOST_UNKNOWNS, StationProduct
from catenary.solver.linear.station_rows import LikeStations, Sections
from catenary.solver.linear.unit_responses import Windows
from catenary.solver.model.matrices import coupled_with, part_of
from catenary.solver.model.model import Model
from catenary.solver.model.partition import Ownership
from catenary.solver.problem.problem import BOUNDED


class StepArrays:
    """Arrays over what a rank solves for and reads, made once. Not collective to make.

    Nothing in the loop makes or copies arrays. An array taken from a vector would keep it, and the
    communicator, alive beyond ``destroy``.

    Parameters
    ----------
    domain : ranges that the rank solves for, and that products over it read
    pad : further numbers at both ends that products by stations read, zero where the line ends
    comm : communicator of PETSc's solver

    Attributes
    ----------
    padded, read : vector that products multiply, with and without ``pad``
    factor : (n_local,) the rank's own part of ``read``
    force, loaded : (domain.size,) right-hand sides of a solve: internal force [N], and room for
        that with loads
    solution : (domain.size,) of a solve; ``answer`` (n_local,) is the rank's own part of it
    read_domain : vector of ``read`` as far as the rank solves for it
    padded_rates, rates : vector that products with C multiply in two passes, as ``padded`` and
        ``read``; made when they are first asked for
    read_here, force_here, loaded_here : vectors of this rank alone, which products read and
        fill; the solver may view the same arrays as vectors of all ranks
    """

    def __init__(self, domain: Subdomain, pad: int, comm: Any) -> None:
        self._pad = pad
        size, n_read = domain.size, domain.read_high - domain.read_low
        self.padded = aligned_arrays.zeros(n_read + 2 * pad, 0)
        self.read = read = self.padded[pad : pad + n_read]
        answer, force = aligned_arrays.zeros(size, 1), aligned_arrays.zeros(size, 2)
        loaded = aligned_arrays.zeros(size, 3)
        self.read_here, self.force_here, self.loaded_here = here = [
            PETSc.Vec().createWithArray(array, comm=PETSc.COMM_SELF)
            for array in (read, force, loaded)
        ]
        solved_for = read[domain.low - domain.read_low : domain.high - domain.read_low]
        self.force, self.loaded, self.solution, read_domain = solved = [
            Wrapped(array, PETSc.Vec().createWithArray(array, size=(size, None), comm=comm))
            for array in (force, loaded, answer, solved_for)
        ]
        self.read_domain = read_domain.vector
        self._vectors = (*here, *(pair.vector for pair in solved))
        self.factor, self.answer = read[domain.owned_of_read], answer[domain.owned]

    @cached_property
    def padded_rates(self) -> np.ndarray:
        return aligned_arrays.zeros(self.padded.size, 6)

    @cached_property
    def rates(self) -> np.ndarray:
        return self.padded_rates[self._pad : self.padded.size - self._pad]

    def destroy(self) -> None:
        """Free the vectors. Collective."""
        for vector in self._vectors:
            vector.destroy()


logger = logging.getLogger(__name__)
_TOGETHER = (
    "solving on each rank by itself leaves a residual of %.1e; taking PETSc's distributed solver "
    "instead"
)
_ITERATING = "the solver leaves a residual of %.1e in one application; iterating with GMRES"

Loads = list[tuple[np.ndarray, np.ndarray]]


class ByStations(NamedTuple):
    """A product with K and factors of A by stations, and the arrays that both work on.

    ``read`` is the operand of the product and ``rates`` that of a product with C; the solve fills
    ``answer`` at all unknowns that are solved for. If ``by_mass`` is not 0 the product is with M,
    and ``by_mass`` times its operand is to be added to the answer.
    """

    product: StationProduct
    factors: StationFactors
    read: np.ndarray
    rates: np.ndarray
    answer: np.ndarray
    by_mass: float


class LineOperators:
    """K, C and the factored A of the distributed line. Collective to make.

    Parameters
    ----------
    comm : mpi4py communicator
    model : Model, on all ranks
    ownership : Ownership
    coefficients : of M, K and C in A
    windows : Windows, whose reach is that of A^-1
    in_pieces : maker of products and factors of a part of the line, on one rank; if None all of
        it has some

    Attributes
    ----------
    factor : (n_local,) this rank's part of the operand of products, to be filled in
    answer : (n_local,) this rank's part of the last solution
    domain : Subdomain
    like : marks of the line's stations, None if it is in pieces
    in_pieces : as given
    """

    # None on a rank that owns nothing.
    _solver: PartSolver | SchwarzSolver | None = None
    _is_direct = True
    # A product with the operator, until it is verified.
    _checked: StationProduct | None = None
    _rate_halo: Halo | None = None

    def __init__(
        self,
        comm: Any,
        model: Model,
        ownership: Ownership,
        coefficients: tuple[float, float, float],
        windows: Windows,
        in_pieces: OperatorPieces | None = None,
    ) -> None:
        self._comm = comm
        self._model = model
        self._ownership = ownership
        self._coefficients = coefficients
        self.in_pieces = in_pieces
        self.like = LikeStations(model) if in_pieces is None else None
        self._block, self._pad = model.numbering.block, model.numbering.width
        self._product_event, self._solve_event = event("LineProduct"), event("LineSolve")
        if in_pieces is not None:
            # Solutions are verified piece by piece.
            self._solve_apart(windows)
            self._products.prepare()
            return
        if comm.size > 1 and wants_distributed_solver():
            self._solve_together(windows)
            residual = self.residual()
        else:
            self._solve_apart(windows)
            residual = self.residual()
            if not residual <= DIRECT and comm.size > 1:
                logger.warning(_TOGETHER, residual)
                self.destroy()
                self._solve_together(windows)
                residual = self.residual()
        if not np.isfinite(residual):
            raise RunBroken("the step operator cannot be factored: it is singular or not finite")
        if residual > DIRECT and self._is_direct:
            logger.warning(_ITERATING, residual)
            if self._solver is not None:
                self._solver.iterate()
            self._is_direct = False
        if isinstance(self._solver, PartSolver):
            if comm.size > 1 and comm.rank == 0 and wants_view():
                self._solver.view()  # one for all; on one rank PETSc shows it at its first solve
            self._solver.bypass_ksp()
        self._checked = None
        self._products.prepare()

    def by_stations(
        self, damped: bool, shares: tuple[float, float] | None = None
    ) -> ByStations | None:
        """Operators of a step in two passes, None unless all goes by stations. Not collective.

        The operator is then factored and multiplied by stations, and solved for in one application.
        ``damped`` steps need a product with C, of ``rate``, too. If A is a sum of M and K, the
        ``shares`` of both let steps take M where that is shorter.
        """
        product, solver = self._products.by_stations("stiffness", damped), self._solver
        if product is None or not isinstance(solver, PartSolver):
            return None
        if solver.factors is None or not self._is_direct:
            return None
        arrays, read = self._arrays, self._arrays.padded
        rates = arrays.padded_rates if damped else read
        by_mass = 0.0
        # Beyond the ends of a bounded window the state is not zero, which A^-1 A x would need.
        if shares is not None and self._model.problem.window.mode != BOUNDED:
            instead = self._products.instead_of_stiffness(*shares)
            if instead is not None:
                product, by_mass = instead, 1.0 / shares[1]
        return ByStations(product, solver.factors, read, rates, arrays.solution.array, by_mass)

    @property
    def station_widths(self) -> tuple[int, ...]:
        """Unknowns of a whole cross-section in each plane that no matrix joins to others.

        Of all in one where stations have no kernels of their own.
        """
        layout = self._products.layout
        return (self._model.numbering.width,) if layout is None else layout.widths

    def why_not_by_stations(self) -> str:
        """Reason why ``by_stations`` is None on some rank, the same on all. Collective."""
        reasons = {
            1: "the options of PETSc choose another solver",
            2: "the nodes of the wires are too many or too few to form stations",
            3: f"the model joins stations further apart, or has more than {MOST_UNKNOWNS} unknowns "
            "a station",
        }
        found = 1
        if not self._in_stations:
            found = 2
        elif self._products.layout is None and isinstance(self._solver, PartSolver):
            found = 3
        return reasons[self._comm.allreduce(found, op=MPI.MAX)]

    def exchange(self) -> None:
        """Bring ``factor``, and ``rate`` if it is used, up to date where they are others'.

        Collective.
        """
        self._halo.exchange()
        if self._rate_halo is not None:
            self._rate_halo.exchange()

    def multiply_stiffness(self) -> None:
        """Make K ``factor`` the internal force. Right after ``exchange``. Not collective."""
        self._product_event.begin()
        self._products.multiply("stiffness", self._arrays.force.array, self._arrays.force_here)
        self._product_event.end()

    def add_damping(self) -> None:
        """Add C ``factor`` to the internal force. Right after ``exchange``. Not collective."""
        arrays = self._arrays
        self._products.multiply("damping", arrays.loaded.array, arrays.loaded_here)
        arrays.force.array[:] += arrays.loaded.array

    def add_force(self, force: np.ndarray) -> None:
        """Add a force on all that is solved for, shape (domain.size,) [N], to the internal force.

        Not collective.
        """
        self._arrays.force.array[:] += force

    def solve(self, loads: Loads | None = None) -> None:
        """Solve A ``answer`` = internal force + ``loads``. Collective with loads.

        ``loads`` are pairs of local unknowns and forces [N], perhaps none here; None on all ranks
        if no rank has any, which saves an exchange.

        Raises
        ------
        RunBroken
            On all ranks, if an iteration does not converge; a direct solver was verified.
        """
        right = self._arrays.force
        if loads is not None:
            right, owned = self._arrays.loaded, self.domain.owned
            right.array[owned] = self._arrays.force.array[owned]
            for dofs, values in loads:
                np.add.at(right.array[owned], dofs, values)
            self._loaded_halo.exchange()
        self._solve_event.begin()
        self._solve(right)
        self._solve_event.end()

    def solve_for(self, dofs: np.ndarray, coefficients: np.ndarray) -> np.ndarray:
        """Answer to forces ``coefficients`` at global unknowns ``dofs``. Collective.

        All ranks pass the same. Returns ``answer``, shape (n_local,).
        """
        low, high = self.domain.low, self.domain.high
        here = (dofs >= low) & (dofs < high)
        loaded = self._arrays.loaded
        loaded.array[:] = 0.0
        np.add.at(loaded.array, dofs[here] - low, coefficients[here])
        self._solve(loaded)
        return self.answer

    def square(self, name: str) -> float:
        """This rank's part of x M x or x K x for x in ``factor``, by ``name``. Collective."""
        self.exchange()
        if not self.domain.size:
            return 0.0
        arrays = self._arrays
        self._products.multiply(name, arrays.loaded.array, arrays.loaded_here)
        return float(arrays.loaded.array[self.domain.owned] @ self.factor)

    def by_rows(self) -> tuple[StationProduct, StationProduct, int] | None:
        """Products with M and K by stations on one rank, and the padding of their operands.

        The padding is the number of unknowns by which an operand is longer than the line at either
        end. None on several ranks, or without products by stations. Not collective.
        """
        mass, stiffness = (self._products.by_stations(name) for name in ("mass", "stiffness"))
        if self._comm.size > 1 or mass is None or stiffness is None:
            return None
        return mass, stiffness, self._pad

    def residual(self) -> float:
        """Relative residual of a solve with a load on every unknown. Collective.

        Overwrites ``factor`` and ``answer``.
        """
        owned, arrays, loaded = self.domain.owned, self._arrays, self._arrays.loaded
        load = trial_load(self.domain.low, self.domain.high)
        loaded.array[:] = load
        self._solve(loaded)
        self.factor[:] = self.answer
        self.answer[:] = 0.0
        self.exchange()
        if self._checked is not None:
            low, size = self.domain.low - self.domain.read_low, self.domain.size
            # Beyond what is solved for the operator has no entries.
            read = arrays.padded[low : low + size + 2 * self._pad]
            self._checked.multiply(read, loaded.array)
        elif self._solver is not None:
            self._solver.matrix.mult(arrays.read_domain, loaded.vector)
        missing = loaded.array[owned] - load[owned]
        squares = np.array([missing @ missing, load[owned] @ load[owned]])
        self._comm.Allreduce(MPI.IN_PLACE, squares)
        return float(np.sqrt(squares[0] / squares[1]))

    @property
    def rate(self) -> np.ndarray:
        """This rank's part (n_local,) of the operand of products with C in two passes, to be filled
        in. Collective at its first use."""
        rates, domain = self._arrays.rates, self.domain
        if self._rate_halo is None:
            self._rate_halo = Halo(self._comm, self._ownership, domain.read_low, rates)
        return rates[domain.owned_of_read]

    @property
    def traffic(self) -> tuple[int, int]:
        """Messages and bytes that this rank sends at an exchange."""
        return self._halo.messages, self._halo.bytes_sent

    def destroy(self) -> None:
        """Free all PETSc objects and messages. Collective."""
        for halo in (self._halo, self._loaded_halo, self._rate_halo):
            if halo is not None:
                halo.destroy()
        for held in (self._solver, self._products, self._arrays):
            if held is not None:
                held.destroy()

    def _solve_apart(self, windows: Windows) -> None:
        """Set up a solver on each rank, for its own part and as much as can influence it."""
        low, high = self._overlap(windows)
        self._make_arrays(low, high, PETSc.COMM_SELF)
        is_direct = True
        if self.domain.size:
            rows, owned = (low, high), self.domain.owned
            products, stations = self._products, Sections.of(self._model.numbering, low, high)
            begin, end = np.searchsorted(stations.starts, [owned.start, owned.stop]).tolist()
            operator, whole = None, self._comm.size == 1
            factors = None if self.in_pieces is None else self.in_pieces.factors.factors
            if self._in_stations and factors is None:
                operator = products.find_layout(self._coefficients)
            if operator is not None and products.layout and allows_own_factors(whole):
                turns = whole and self._model.problem.window.moves
                factors = station_factors(operator, products.layout, stations, begin, end, turns)

            def assembled() -> sparse.bsr_matrix:
                return part_of(self._model, rows, rows, self._coefficients, 1.0, self._block)

            solver = PartSolver(assembled, self._in_stations, whole, factors)
            self._solver, is_direct = solver, solver.is_direct
            if operator is not None and factors is not None:
                self._checked = products.of_operator(operator)
        self._is_direct = bool(self._comm.allreduce(int(is_direct), op=MPI.MIN))

    def _solve_together(self, windows: Windows) -> None:
        """Set up PETSc's solver for the whole line on all ranks."""
        first, last = self._ownership.first, self._ownership.last
        self._make_arrays(first, last, self._comm)
        rows, whole = (first, last), (0, self._model.n_dofs)
        part = part_of(self._model, rows, whole, self._coefficients, 1.0, self._block)
        solver = SchwarzSolver(
            self._comm, part, self._ownership, self._overlap(windows), self._in_stations
        )
        self._solver, self._is_direct = solver, solver.is_direct

    @property
    def _in_stations(self) -> bool:
        return self._model.numbering.in_stations

    def _overlap(self, windows: Windows) -> tuple[int, int]:
        """Range of unknowns that influence this rank's own within a step, of whole stations."""
        model, ownership = self._model, self._ownership
        first, last = ownership.first, ownership.last
        if first == last:
            return first, last
        places = model.numbering
        begin, end = places.stations_over(first, last)
        near = windows.around(float(places.low[begin]), float(places.high[end - 1]))
        coupled = coupled_with(model, (first, last))
        return places.whole(min(near[0], coupled[0]), max(near[1], coupled[1]))

    def _make_arrays(self, low: int, high: int, comm: Any) -> None:
        """Arrays for [low, high), products over it, and the halos of both."""
        own, model = self._ownership, self._model
        read_low, read_high = model.numbering.whole(*coupled_with(model, (low, high)))
        self.domain = domain = Subdomain(own.first, own.last, low, high, read_low, read_high)
        self._arrays = arrays = StepArrays(domain, self._pad, comm)
        here = domain, arrays.padded, arrays.read_here
        self._products = LineProducts(model, *here, self.like, self.in_pieces)
        self.factor, self.answer = arrays.factor, arrays.answer
        self._halo = Halo(self._comm, own, read_low, arrays.read)
        self._loaded_halo = Halo(self._comm, own, low, arrays.loaded.array)
        self._rate_halo = None

    def _solve(self, right: Wrapped) -> None:
        if self._solver is not None:
            self._solver.solve(right, self._arrays.solution)
        if not self._is_direct:
            reason = 0 if self._solver is None else self._solver.failure
            reason = self._comm.allreduce(reason, op=MPI.MIN)
            if reason:
                raise NotConverged(
                    f"the linear solver did not converge (PETSc reason {reason}); drop the options "
                    f"under -{PREFIX} or give the scene a smaller numerics.dt_s"
                )
