"""All strips of a train at the end of a step, as functions of the contact forces."""

from __future__ import annotations

import numpy as np

from catenary.mbs.interface import HeadState


class Heads(HeadState):
    """Heads over all n contacts of a train; pantographs fill their parts of it.

    The compliances are zero between strips of different pantographs. ``early_height`` and
    ``early_velocity`` (n,) hold what an extrapolation of the motion says, if a coupling asks for
    it.
    """

    def __init__(self, n: int) -> None:
        super().__init__(n)
        self.early_height = np.zeros(n)
        self.early_velocity = np.zeros(n)

    def put(self, strips: slice, head: HeadState) -> None:
        """Copy the state of one pantograph's head to its ``strips``."""
        self.height[strips] = head.height
        self.velocity[strips] = head.velocity
        self.height_compliance[strips, strips] = head.height_compliance
        self.velocity_compliance[strips, strips] = head.velocity_compliance
