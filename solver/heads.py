"""All strips of a train at the end of a step, as functions of the contact forces."""

from __future__ import annotations

import numpy as np

from catenary.mbs.interface import HeadState


class Heads:
    """Arrays over all n contacts of a train; pantographs fill their parts of them.

    height = ``height`` - ``height_compliance`` f [m], velocity = ``velocity`` -
    ``velocity_compliance`` f [m/s] for contact forces f (n,) [N]. The compliances, (n, n), are
    zero between strips of different pantographs. ``early_height`` and ``early_velocity`` (n,) hold
    what an extrapolation of the motion says, if a coupling asks for it.
    """

    def __init__(self, n: int) -> None:
        self.height = np.zeros(n)
        self.velocity = np.zeros(n)
        self.height_compliance = np.zeros((n, n))
        self.velocity_compliance = np.zeros((n, n))
        self.early_height = np.zeros(n)
        self.early_velocity = np.zeros(n)

    @property
    def n(self) -> int:
        """Number of contacts."""
        return int(self.height.size)

    def part(self, strips: slice) -> HeadState:
        """Views of what concerns some strips."""
        return HeadState(
            self.height[strips],
            self.velocity[strips],
            self.height_compliance[strips, strips],
            self.velocity_compliance[strips, strips],
        )

    def adopt(self, head: HeadState) -> None:
        """Stand for the strips of the only pantograph there is: its arrays themselves."""
        self.height, self.velocity = head.height, head.velocity
        self.height_compliance = head.height_compliance
        self.velocity_compliance = head.velocity_compliance

    def pack(self) -> np.ndarray:
        """All numbers as one array, for a message."""
        parts = (self.height, self.velocity, self.height_compliance, self.velocity_compliance)
        return np.concatenate([part.ravel() for part in parts])

    def unpack(self, packed: np.ndarray) -> None:
        """Take what ``pack`` gave."""
        n = self.n
        self.height[:], self.velocity[:] = packed[:n], packed[n : 2 * n]
        matrices = packed[2 * n :].reshape(2, n, n)
        self.height_compliance[:], self.velocity_compliance[:] = matrices
