"""Motion of the pantographs' bases by the vehicle: tables, harmonics, track irregularities.

Up and to the left are positive. What is a function of the place along the track, such as the track
itself, reaches every pantograph of the train when it gets there; what is a function of time reaches
all at once. Velocities and accelerations are derivatives of the same splines and sines.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from catenary.mbs.vehicle.irregularity import Irregularity
from catenary.mbs.vehicle.suspension import Vehicle, roof_course, transfer
from catenary.solver.kernels import native


@dataclass(frozen=True)
class Table:
    """A cubic spline through ``values`` [m] at ``points``, which grow.

    ``points`` are times [s], or with ``along_track`` places [m]. It is not bent at
    its ends, where it must not be left.
    """

    points: tuple[float, ...]
    values: tuple[float, ...]
    along_track: bool = False


@dataclass(frozen=True)
class Harmonic:
    """``amplitude`` sin(2 pi ``frequency`` t + ``phase``) [m], [Hz], [rad]."""

    amplitude: float
    frequency: float
    phase: float = 0.0


Source = Table | Harmonic | Irregularity


@dataclass(frozen=True)
class VehicleMotion:
    """Sums of sources that move the bases of a train's pantographs, up and to the left.

    What depends on the place is the track, which reaches the bases through a ``suspension``;
    without one they follow it as it is. What depends on time is their own motion in either case.
    """

    vertical: tuple[Source, ...] = ()
    lateral: tuple[Source, ...] = ()
    suspension: Vehicle | None = None


# A spline of the track is followed in such steps [m].
_FINE = 0.1


class Motion(NamedTuple):
    """Place [m], velocity [m/s] and acceleration [m/s^2] in one direction."""

    place: float
    velocity: float
    acceleration: float


# A function of one variable with two derivatives.
_Course = Callable[[float], tuple[float, float, float]]


def _spline(points: Sequence[float] | np.ndarray, values: object) -> _Course:
    from scipy.interpolate import CubicSpline  # not loaded for vehicles that stand still

    spline = CubicSpline(points, values, bc_type="natural")
    return native.spline_at.bound(spline.x, np.ascontiguousarray(spline.c.T))


class BaseMotion:
    """The base of one pantograph under way.

    Parameters
    ----------
    vehicle : VehicleMotion
    start : of the pantograph along the track at time 0 [m]
    speed : of the train [m/s]
    """

    def __init__(self, vehicle: VehicleMotion, start: float, speed: float) -> None:
        self._start, self._speed = start, speed
        self._vertical = [_course(one, "vertical", vehicle, speed) for one in vehicle.vertical]
        self._lateral = [_course(one, "lateral", vehicle, speed) for one in vehicle.lateral]

    @property
    def along_track(self) -> bool:
        """Whether its height depends on the place along the track."""
        return any(along_track for _, along_track in self._vertical)

    def vertical(self, time: float) -> Motion:
        """Upward motion at ``time`` [s]."""
        return self._sum(self._vertical, time)

    def lifts(self, times: np.ndarray) -> np.ndarray:
        """Upward motions at ``times`` (n,) [s], (3, n)."""
        return np.array([self.vertical(time) for time in times.tolist()]).T

    def lateral(self, time: float) -> Motion:
        """Motion to the left at ``time`` [s]."""
        return self._sum(self._lateral, time)

    def _sum(self, courses: list[tuple[_Course, bool]], time: float) -> Motion:
        place = velocity = acceleration = 0.0
        for course, along_track in courses:
            at, pace = (
                (self._start + self._speed * time, self._speed) if along_track else (time, 1.0)
            )
            value, first, second = course(at)
            place += value
            velocity += pace * first
            acceleration += pace**2 * second
        return Motion(place, velocity, acceleration)


def lifted(base: BaseMotion | None, time: float) -> tuple[float, float]:
    """Lift [m] and upward velocity [m/s] of a base at ``time`` [s], both zero without one."""
    if base is None:
        return 0.0, 0.0
    return base.vertical(time)[:2]


def _course(
    source: Source, direction: str, vehicle: VehicleMotion, speed: float
) -> tuple[_Course, bool]:
    """A source as a function, and whether it is one of the place along the track."""
    suspension = vehicle.suspension
    if isinstance(source, Harmonic):
        rate = 2.0 * np.pi * source.frequency
        waves = (np.array([v]) for v in (source.amplitude, rate, source.phase))
        return native.sines_at.bound(*waves), False
    if isinstance(source, Table):
        if suspension is None or not source.along_track:
            return _spline(source.points, source.values), source.along_track
        return _spline(*_roof_course(source, direction, suspension, speed)), True
    amplitudes, wave_numbers, phases = source.waves(direction)
    if suspension is not None:
        passed = transfer(suspension, direction, wave_numbers, speed)
        amplitudes, phases = amplitudes * np.abs(passed), phases + np.angle(passed)
    return native.sines_at.bound(amplitudes, wave_numbers, phases), True


def _roof_course(
    source: Table, direction: str, suspension: Vehicle, speed: float
) -> tuple[np.ndarray, np.ndarray]:
    """Places and heights of the roof above a track that follows a spline."""
    from scipy.interpolate import CubicSpline

    spline = CubicSpline(source.points, source.values, bc_type="natural")
    n = int(np.ceil((spline.x[-1] - spline.x[0]) / _FINE)) + 1
    points = np.linspace(spline.x[0], spline.x[-1], max(n, 2))
    return roof_course(suspension, direction, points, spline(points), speed)
