"""Motion of the contact wire in a run, over place and time, and over their frequencies."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from catenary.postproc.film.film_data import FilmData
from catenary.postproc.film.snapshots import Snapshots
from catenary.solver.base.errors import InputError

# Distance of points along the wire between which the motion is interpolated [m].
_STEP = 0.5


@dataclass(frozen=True)
class WavesSeen:
    """Motion of the contact wire at t times and n places.

    Attributes
    ----------
    time : (t,) at equal distances [s]
    x : (n,) at equal distances [m]
    uplift, velocity : (t, n) [m], [m/s]; the velocity at a time is that of the steps around it
    position : (t, p) of the pantographs [m]
    """

    time: np.ndarray
    x: np.ndarray
    uplift: np.ndarray
    velocity: np.ndarray
    position: np.ndarray

    def in_the_train(self, behind: float, ahead: float) -> tuple[np.ndarray, np.ndarray]:
        """Places relative to the first pantograph (m,) [m], and the velocity there (t, m) [m/s].

        NaN beyond the ends of the line.
        """
        relative = np.arange(-behind, ahead + _STEP, _STEP)
        rows = [
            np.interp(place + relative, self.x, row, left=np.nan, right=np.nan)
            for place, row in zip(self.position.max(axis=1), self.velocity, strict=True)
        ]
        return relative, np.array(rows)

    def spectrum(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Wavenumbers (k,) [rad/m], frequencies (f,) [Hz] and amplitudes (f, k) of the velocity.

        A wave exp(i (omega t - k x)) that runs with the train stands at positive k and omega. Both
        directions are tapered by Hann's window; the largest amplitude is 1.
        """
        taper = np.hanning(self.time.size)[:, None] * np.hanning(self.x.size)
        # The sign of k: numpy's transform is of exp(+i k x) where a wave has exp(-i k x).
        changed = np.fft.fft2(self.velocity * taper)
        frequency = np.fft.fftfreq(self.time.size, self.time[1] - self.time[0])
        k = -2 * np.pi * np.fft.fftfreq(self.x.size, _STEP)
        amplitude, order = np.abs(changed[frequency >= 0.0]), np.argsort(k)
        amplitude = amplitude[:, order]
        return k[order], frequency[frequency >= 0.0], amplitude / max(amplitude.max(), 1e-300)


def waves_seen(data: FilmData, snapshots: Snapshots) -> WavesSeen:
    """The motion of the contact wire in the snapshots of a run. Not collective.

    Raises
    ------
    InputError
        If the snapshots are not at equal distances in time, or fewer than three.
    """
    times = snapshots.times
    apart = np.diff(times)
    if times.size < 3 or np.ptp(apart) > 1e-6 * apart[0]:
        raise InputError("the run needs three snapshots or more at equal distances in time")
    nodes = data.wires[data.contact]
    along = data.points[nodes, 0]
    x = np.arange(along[0], along[-1], _STEP)
    uplift = np.empty((times.size, x.size), dtype=np.float32)
    for number in range(times.size):
        uplift[number] = np.interp(x, along, snapshots.uplift(number)[nodes])
    rows = [data.row_at(time) for time in times.tolist()]
    return WavesSeen(
        times, x, uplift, np.gradient(uplift, float(apart[0]), axis=0), data.position[rows]
    )
