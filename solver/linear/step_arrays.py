"""Arrays of a rank that a step's product reads and its solve fills, and PETSc's vectors of them."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from catenary.base.petsc import PETSc
from catenary.solver.kernels import aligned_arrays
from catenary.solver.linear.halo import Subdomain
from catenary.solver.linear.petsc_solvers import Wrapped


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
    read_here, force_here, loaded_here : vectors of this rank alone. What products fill is the
        rank's, what is solved for perhaps the line's: two views of one array.
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
