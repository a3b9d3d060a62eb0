"""What a second program finds of contact forces, and its figures."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import signal
from scipy.interpolate import CubicSpline


@dataclass
class ForceHistory:
    """Time step [s], places and forces (n, pantographs) [m], [N], and largest uplift at arms of the
    evaluated stretch [m]."""

    dt: float
    place: np.ndarray
    force: np.ndarray
    uplift: float

    def statistics(
        self, stretch: tuple[float, float], p: int = 0, every: float | None = None
    ) -> dict[str, float]:
        """Mean, deviation, maximum and minimum of a force below 20 Hz [N], of samples ``every`` so
        many metres from the first one on, or at each step."""
        first, second = self.place[:2, p]
        step = second - first if every is None else every
        # Samples that are at an end of the stretch but for round-off count.
        begin, end = (np.array(stretch) - first) / step
        own = self.at(first + step * np.arange(np.ceil(begin - 1e-6), np.floor(end + 1e-6) + 1), p)
        return {"mean_N": own.mean(), "std_N": own.std(), "max_N": own.max(), "min_N": own.min()}

    def at(self, places: np.ndarray, p: int = 0) -> np.ndarray:
        """A force below 20 Hz at places (n,) [m], by a cubic spline [N]."""
        return np.asarray(CubicSpline(self.place[:, p], self.filtered[:, p])(places))

    @property
    def filtered(self) -> np.ndarray:
        """Forces after the low-pass of EN 50317, forward and backward."""
        sections = signal.butter(6, 20.0, fs=1.0 / self.dt, output="sos")
        return signal.sosfiltfilt(sections, self.force, axis=0, padlen=int(0.3 / self.dt))
