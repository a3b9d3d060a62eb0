"""What a second program finds of contact forces, and its figures."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import signal


@dataclass
class ForceHistory:
    """Time step [s], places and forces (n, pantographs) [m], [N], and largest uplift at arms of the
    evaluated stretch [m]."""

    dt: float
    place: np.ndarray
    force: np.ndarray
    uplift: float

    def statistics(self, stretch: tuple[float, float], p: int = 0) -> dict[str, float]:
        """Mean, deviation, maximum and minimum of a force below 20 Hz [N]."""
        filtered = self.filtered[:, p]
        place = self.place[:, p]
        own = filtered[(place >= stretch[0]) & (place <= stretch[1])]
        return {"mean_N": own.mean(), "std_N": own.std(), "max_N": own.max(), "min_N": own.min()}

    @property
    def filtered(self) -> np.ndarray:
        """Forces after the low-pass of EN 50317, forward and backward."""
        sections = signal.butter(6, 20.0, fs=1.0 / self.dt, output="sos")
        return signal.sosfiltfilt(sections, self.force, axis=0, padlen=int(0.3 / self.dt))
