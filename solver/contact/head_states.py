"""All strips of a train at the end of a step, as functions of the contact forces."""

from __future__ import annotations

import numpy as np

from catenary.mbs.interface import HeadState
from catenary.solver.contact.line_response import affine
from catenary.solver.kernels import native


class Heads(HeadState):
    """Heads over all n contacts of a train; pantographs fill their parts of it.

    The compliances are zero between strips of different pantographs. ``early_height`` and
    ``early_velocity`` (n,) hold what an extrapolation of the motion says, if a coupling asks for
    it. ``affine`` are the same numbers under the names that they have for line and gap.
    """

    affine: native.Affine

    def __init__(self, n: int) -> None:
        super().__init__(n)
        self.early_height = np.zeros(n)
        self.early_velocity = np.zeros(n)

    def take(self, numbers: np.ndarray, n_strips: int) -> None:
        """Stand for these numbers."""
        super().take(numbers, n_strips)
        self.affine = affine(numbers, n_strips)

    @property
    def n(self) -> int:
        """Number of contacts."""
        return int(self.height.size)

    def put(self, strips: slice, head: HeadState) -> None:
        """Copy the state of one pantograph's head to its ``strips``."""
        self.height[strips] = head.height
        self.velocity[strips] = head.velocity
        self.height_compliance[strips, strips] = head.height_compliance
        self.velocity_compliance[strips, strips] = head.velocity_compliance

    def adopt(self, head: HeadState) -> None:
        """Stand for the strips of the only pantograph there is: its arrays themselves."""
        if head.numbers is not self.numbers:
            self.take(head.numbers, self.n)
