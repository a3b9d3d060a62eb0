"""How contact wires move across the track where strips meet them, with lateral motion."""

from __future__ import annotations

from typing import Any

import numpy as np
from mpi4py import MPI

from catenary.solver.contact.contact_wire import ContactWires
from catenary.solver.contact.contacts import Across, Contacts, Sideways
from catenary.solver.kernels import native
from catenary.solver.model.model import Model
from catenary.solver.model.partition import Ownership
from catenary.solver.statics.form_finding.equilibrium import Equilibrium


def sideways_of(
    model: Model, form: Equilibrium, wires: ContactWires, ownership: Ownership
) -> Sideways:
    """Of a line with lateral motion, which is at rest in ``form``."""
    dofs = np.stack([model.dofs(wires.mesh_nodes, name) for name in ("v", "theta_z")], axis=1)
    mine = ownership.owned(dofs)
    local = np.where(mine, dofs - ownership.first, 0).astype(np.int64)
    assert form.lateral is not None
    rest = np.stack([form.lateral.y, form.lateral.slope], axis=1)[wires.mesh_nodes]
    return Sideways(local, mine, rest)


class WiresAcross:
    """Lateral motion of the contact wires at n contacts, summed over ranks.

    It is taken after a free step, without what the step's contact forces and slack droppers add:
    beside an arm h^2 / 4 times a force on some kilograms, less than 1e-4 m in steps of 1 ms.

    Parameters
    ----------
    across : (3, n) what ``Across`` is on rank 0, row by row; overwritten

    Attributes
    ----------
    share : Across of this rank
    """

    def __init__(self, comm: Any, across: np.ndarray) -> None:
        self._comm, self._across = comm, across
        self._share = across if comm.size == 1 else np.zeros(across.shape)
        self.share = Across(*self._share)

    def find(self, contacts: Contacts) -> None:
        """Fill in where the contacts, which are located, meet the wires. Collective."""
        native.find_across(contacts)
        if self._comm.size > 1:
            everything = self._across if self._comm.rank == 0 else None
            self._comm.Reduce(self._share, everything, op=MPI.SUM, root=0)
