"""How contact wires move across the track where strips meet them, with lateral motion."""

from __future__ import annotations

from typing import Any

import numpy as np
from mpi4py import MPI

from catenary.solver.base.kernels.bound import bound
from catenary.solver.contact.contact_wire import ContactWires
from catenary.solver.contact.crossing_kernels import Sideways, find_across
from catenary.solver.integrators.line_integrator import LineIntegrator
from catenary.solver.model.model import Model
from catenary.solver.statics.form_finding.equilibrium import Equilibrium


class WiresAcross:
    """Lateral motion of the contact wires at n contacts.

    It is taken after a free step, without what the step's contact forces and slack droppers add:
    beside an arm h^2 / 4 times a force on some kilograms, less than 1e-4 m in steps of 1 ms.

    Attributes
    ----------
    finding : arguments of ``find_across``

    Parameters
    ----------
    touches : (n,) records of ``TOUCH``, located before ``find``
    form : the line at rest
    across : (3, n) lateral places [m], their total rates [m/s] and displacements [m] of the wires,
        on rank 0; overwritten
    """

    def __init__(
        self,
        comm: Any,
        model: Model,
        form: Equilibrium,
        wires: ContactWires,
        line: LineIntegrator,
        touches: np.ndarray,
        train_speed: float,
        across: np.ndarray,
    ) -> None:
        dofs = np.stack([model.dofs(wires.mesh_nodes, name) for name in ("v", "theta_z")], axis=1)
        mine = line.ownership.owned(dofs)
        local = np.where(mine, dofs - line.ownership.first, 0).astype(np.int64)
        self._comm, self._across = comm, across
        self._share = across if comm.size == 1 else np.zeros(across.shape)
        self._is_empty = line.ownership.n_local == 0
        assert form.lateral is not None
        rest = np.stack([form.lateral.y, form.lateral.slope], axis=1)[wires.mesh_nodes]
        sideways = Sideways(local, mine.astype(float), rest)
        speed = float(train_speed)
        self.finding = line.motion.read, touches, sideways, speed, self._share
        self._find = bound(find_across, *self.finding)

    def find(self) -> None:
        """Fill in ``across`` where the contacts are now. Collective."""
        if not self._is_empty:
            self._find()
        if self._comm.size > 1:
            everything = self._across if self._comm.rank == 0 else None
            self._comm.Reduce(self._share, everything, op=MPI.SUM, root=0)
