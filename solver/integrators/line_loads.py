"""Forces on a line beside those of contacts and droppers, as the pass forth of a step adds them."""

from __future__ import annotations

from typing import Any

import numpy as np

from catenary.solver.base import aligned_arrays
from catenary.solver.base.compiled import compiled
from catenary.solver.linear.halo import Halo, Subdomain
from catenary.solver.linear.step_operators import Loads
from catenary.solver.model.partition import Ownership


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
        """Make ``values`` the constant forces and ``loads``, see ``LineMotion.free_step``."""
        if self._alone and len(loads) == len(self._latest):
            if all(same(v, kept) for (_, v), kept in zip(loads, self._latest, strict=True)):
                return
        self._latest = [np.array(values, dtype=float) for _, values in loads]
        self.values[:] = self._constant
        for (dofs, _), values in zip(loads, self._latest, strict=True):
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
