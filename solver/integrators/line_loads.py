"""Forces on a line beside those of contacts and droppers, as the pass forth of a step adds them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from catenary.solver.base import aligned_arrays
from catenary.solver.base.compiled import compiled
from catenary.solver.linear.halo import Halo, Subdomain
from catenary.solver.linear.step_operators import Loads
from catenary.solver.model.model import Model, StepLoad
from catenary.solver.model.partition import Ownership


class StepLoads:
    """A rank's part of the loads of a model that change with time. Not collective.

    Forces on held unknowns are left out.
    """

    def __init__(self, model: Model, ownership: Ownership) -> None:
        free = ~np.isin(np.arange(model.n_dofs), model.constrained)
        self._parts: list[_Part] = []
        for load in model.step_loads:
            mine = np.flatnonzero(ownership.owned(load.dofs) & free[load.dofs])
            if mine.size:
                dofs = load.dofs[mine] - ownership.first
                self._parts.append(_Part(load, mine, dofs, np.zeros(0), np.zeros(0)))

    def __call__(self, time: float) -> Loads:
        """Local unknowns and forces at a time [s]; the arrays of before where none changed."""
        for part in self._parts:
            values = np.ascontiguousarray(part.load.values(time), dtype=float)
            if not same(values, part.latest):
                part.latest, part.forces = values.copy(), values[part.mine]
        return [(part.dofs, part.forces) for part in self._parts]


@dataclass
class _Part:
    """A load, the rank's own among its unknowns, all its forces at last, and the rank's own."""

    load: StepLoad
    mine: np.ndarray
    dofs: np.ndarray
    latest: np.ndarray
    forces: np.ndarray


class LineLoads:
    """Forces on all unknowns that a rank solves for. Collective to make, and to ``change``.

    Parameters
    ----------
    comm : mpi4py communicator
    domain : Subdomain
    constant : (n_dofs,) forces that stay [N], [N m], the same on all ranks; None if there are none

    Attributes
    ----------
    values : (domain.size,) their sum with those of the latest ``change`` [N], [N m]
    """

    def __init__(
        self, comm: Any, ownership: Ownership, domain: Subdomain, constant: np.ndarray | None
    ) -> None:
        self._alone, self._owned = comm.size == 1, domain.owned
        self.values = aligned_arrays.zeros(domain.size, 1)
        self._constant = np.zeros(domain.size)
        if constant is not None:
            self._constant[:] = constant[domain.low : domain.high]
        self.values[:] = self._constant
        self._latest: list[np.ndarray] = []
        self._halo = Halo(comm, ownership, domain.low, self.values)

    def change(self, loads: Loads) -> None:
        """Make ``values`` the constant forces and ``loads``, see ``LineIntegrator.free_step``.

        The very arrays of the step before stand for forces that have not changed.
        """
        if self._alone and len(loads) == len(self._latest):
            if all(v is kept for (_, v), kept in zip(loads, self._latest, strict=True)):
                return
        self._latest = [values for _, values in loads]
        self.values[:] = self._constant
        for dofs, values in loads:
            add_at(self.values[self._owned], dofs, values)
        self._halo.exchange()

    def destroy(self) -> None:
        """Free the messages. Collective."""
        self._halo.destroy()


@compiled
def same(values, others):
    """Whether two arrays hold the same numbers."""
    if values.size != others.size:
        return False
    for i in range(values.size):
        if values[i] != others[i]:
            return False
    return True


@compiled
def add_at(total, places, values):
    """Add ``values`` to ``total`` at ``places``, which may repeat."""
    for i in range(places.size):
        total[places[i]] += values[i]
