"""Motion of the contact wire in a run, over place and time, and over their frequencies."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from catenary.base.errors import InputError
from catenary.postproc.film.film_data import FilmData
from catenary.postproc.film.snapshots import Snapshots
from catenary.solver.waves.excitation import Excitation, MovingForce

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
    position : (t, p) of the pantographs, or of a force that moves; p = 0 for a blow [m]
    struck : place of a blow, NaN for all else [m]
    """

    time: np.ndarray
    x: np.ndarray
    uplift: np.ndarray
    velocity: np.ndarray
    position: np.ndarray
    struck: float = np.nan

    @property
    def source(self) -> tuple[float, float]:
        """When [s] and where [m] the waves begin whose speeds are drawn: at a blow, or at the first
        pantograph after three tenths of the run."""
        if not self.position.shape[1]:
            return float(self.time[0]), self.struck
        row = int(0.3 * self.time.size)
        return float(self.time[row]), float(self.position[row].max())

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


def places_of(seen: WavesSeen, time: np.ndarray) -> np.ndarray:
    """Places of what moves at times (t,) [s], or that of a blow at all of them, (t, p) [m]."""
    if not seen.position.shape[1]:
        return np.full((time.size, 1), seen.struck)
    return np.column_stack([np.interp(time, seen.time, course) for course in seen.position.T])


class NodeMotion(Protocol):
    """Takes the motion of all nodes, time after time."""

    def add(self, time: float, uplift: np.ndarray) -> None:
        """The uplift of the nodes (n_nodes,) [m] at a time [s], later than the one before."""


class WireMotion:
    """Collects what `WavesSeen` holds of a wire.

    Parameters
    ----------
    nodes, along : (n,) nodes of the wire in order of x, and their places [m]
    """

    def __init__(self, nodes: np.ndarray, along: np.ndarray) -> None:
        self._nodes, self._along = nodes, along
        self.x = np.arange(along[0], along[-1], _STEP)
        self._times: list[float] = []
        self._rows: list[np.ndarray] = []

    def add(self, time: float, uplift: np.ndarray) -> None:
        """As `NodeMotion.add`."""
        self._times.append(time)
        row = np.interp(self.x, self._along, uplift[self._nodes])
        self._rows.append(row.astype(np.float32))

    def seen(
        self, position: Callable[[np.ndarray], np.ndarray], struck: float = np.nan
    ) -> WavesSeen:
        """All that was added; ``position`` gives (t, p) of what moves at times (t,).

        Raises
        ------
        InputError
            If it was not added at equal distances in time, or fewer than three times.
        """
        times = np.array(self._times)
        apart = np.diff(times)
        if times.size < 3 or np.ptp(apart) > 1e-6 * apart[0]:
            raise InputError("the run needs three snapshots or more at equal distances in time")
        uplift = np.array(self._rows)
        velocity = np.gradient(uplift, float(apart[0]), axis=0)
        return WavesSeen(times, self.x, uplift, velocity, position(times), struck)


def waves_seen(
    data: FilmData, snapshots: Snapshots, others: Sequence[NodeMotion] = ()
) -> WavesSeen:
    """The motion of the contact wire in the snapshots of a run, which ``others`` see as well.

    Not collective.

    Raises
    ------
    InputError
        If the snapshots are not at equal distances in time, or fewer than three.
    """
    nodes = data.wires[data.contact]
    wire = WireMotion(nodes, data.points[nodes, 0])
    for number, time in enumerate(snapshots.times.tolist()):
        uplift = snapshots.uplift(number)
        for one in (wire, *others):
            one.add(time, uplift)
    if data.excitation is not None:
        return wire.seen(*course_of(data.excitation))
    return wire.seen(lambda times: data.position[[data.row_at(t) for t in times.tolist()]])


def course_of(excitation: Excitation) -> tuple[Callable[[np.ndarray], np.ndarray], float]:
    """Where an excitation moves, as `WireMotion.seen` takes it: a blow stays at its place."""
    if isinstance(excitation, MovingForce):
        return lambda times: excitation.place(times)[:, None], np.nan
    return lambda times: np.zeros((times.size, 0)), excitation.at
