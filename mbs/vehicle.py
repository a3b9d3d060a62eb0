"""Motion of the pantographs' bases by the vehicle: splines, harmonics, track irregularities.

Up and to the left are positive. What is a function of the place along the track, such as the track
itself, reaches every pantograph of the train when it gets there; what is a function of time reaches
all at once. Velocities and accelerations are derivatives of the same splines and sines.

**Irregularities** are sums of sines whose power follows a published spectrum. All spectra are
one-sided over the wave number Omega [rad/m]; their integral is the variance.

American, FRA classes 4 to 6 (V. K. Garg, R. V. Dukkipati, Dynamics of Railway Vehicle Systems,
1984): S = k A Oc^2 / (Omega^2 (Omega^2 + Oc^2)), k = 0.25, Oc = 0.8245 rad/m.

German, low and high disturbance (H. Claus, W. Schiehlen, Modeling and simulation of railway bogie
structural vibrations, 1998, after ORE B176): S = A Oc^2 / ((Omega^2 + Or^2) (Omega^2 + Oc^2)),
Oc = 0.8246 rad/m, Or = 0.0206 rad/m.

**The suspension** lets a part of the track's irregularity reach the roof. A car body stands on two
bogies by its secondary suspension, a bogie on the mean of its two wheelsets by its primary one.
Everything is linear, so that upward and sideways motion do not meet:

    upward    body bounce z and pitch t, which lifts the front, bogies z1 and z2
    sideways  body y, yaw w, which moves the front to the left, roll r, which lifts the left side

With s_i = 1, -1 for the front and the rear bogie, half their distance a, and of one bogie the
springs k (secondary), p (primary), q (secondary, sideways); dampers act like springs:

    M z''  = -sum_i k (z + s_i a t - z_i)          I_t t'' = -a sum_i s_i k (z + s_i a t - z_i)
    m z_i'' = k (z + s_i a t - z_i) - p (z_i - u_i)
    M y''  = -sum_i q d_i                          I_w w'' = -a sum_i s_i q d_i
    I_r r'' = -h sum_i q d_i - 2 k b^2 r + M g h r,     d_i = y + s_i a w + h r - v_i

u_i and v_i are the track's height and lateral position below bogie i, the mean of its wheelsets; h
is the height of the body's centre of mass above the springs, 2 b their distance across. Bogies are
held sideways and do not roll. (V. K. Garg, R. V. Dukkipati, Dynamics of Railway Vehicle Systems,
1984, chapter 3.)
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from catenary.solver.kernels import native

if TYPE_CHECKING:
    from scipy import signal

# Waves of a sum; over a factor of 33 in wavelength each stands for 3 % of it.
N_WAVES = 120
GRAVITY = 9.81
# Steps of a wave of the fastest own motion, where a course of the track is followed in time, and
# the shortest step [m].
_STEPS_PER_WAVE, _SHORTEST = 40, 0.01
# A spline of the track is followed in such steps [m].
_FINE = 0.1


class Spectrum(NamedTuple):
    """Spectrum of a track: one-sided density A Oc^2 / ((O^2 + Or^2) (O^2 + Oc^2)) [m^3/rad].

    ``vertical`` and ``lateral`` are the roughness A of either direction [m rad] (k A), ``corner``
    is Oc and ``low`` Or [rad/m].
    """

    vertical: float
    lateral: float
    corner: float
    low: float

    def variance(self, direction: str, lowest: np.ndarray, highest: np.ndarray) -> np.ndarray:
        """Integral of the density from wave number ``lowest`` to ``highest`` [rad/m] of a
        ``direction``, "vertical" or "lateral", in closed form [m^2]."""
        roughness = self.vertical if direction == "vertical" else self.lateral
        oc, low = self.corner, self.low

        def primitive(x: np.ndarray) -> np.ndarray:
            # Partial fractions: 1 / (x^2 + Or^2) less 1 / (x^2 + Oc^2), over Oc^2 - Or^2.
            slow = np.arctan(x / low) / low if low > 0.0 else -1.0 / x
            return (slow - np.arctan(x / oc) / oc) / (oc**2 - low**2)

        return roughness * oc**2 * (primitive(highest) - primitive(lowest))


def _fra(vertical: float, lateral: float) -> Spectrum:
    # k = 0.25; published in cm^2 rad/m.
    return Spectrum(0.25e-4 * vertical, 0.25e-4 * lateral, corner=0.8245, low=0.0)


SPECTRA = {
    "fra_4": _fra(0.5376, 0.3027),
    "fra_5": _fra(0.2095, 0.0762),
    "fra_6": _fra(0.0339, 0.0339),
    "german_low": Spectrum(4.032e-7, 2.119e-7, corner=0.8246, low=0.0206),
    "german_high": Spectrum(10.80e-7, 6.125e-7, corner=0.8246, low=0.0206),
}


@dataclass(frozen=True)
class Irregularity:
    """An irregular track.

    ``spectrum`` is a key of ``SPECTRA``; wavelengths from ``shortest`` to ``longest`` [m]; the same
    ``seed`` gives the same track.
    """

    spectrum: str
    shortest: float
    longest: float
    seed: int

    def waves(self, direction: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Amplitudes [m], wave numbers [rad/m] and phases [rad] of the sines, see ``sines``."""
        variance = partial(SPECTRA[self.spectrum].variance, direction)
        return sines(variance, (self.shortest, self.longest), self.seed, direction)


def sines(
    variance: Callable[[np.ndarray, np.ndarray], np.ndarray],
    wavelengths: tuple[float, float],
    seed: int,
    name: str,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Amplitudes [m], wave numbers [rad/m] and phases [rad] of sines, shape (N_WAVES,).

    Each has the power of its part of the spectrum (M. Shinozuka, C.-M. Jan, Digital simulation of
    random processes, J. Sound Vib. 25, 1972). Wave numbers grow by a constant factor: no two have a
    common multiple nearby, so that the sum does not repeat itself.

    Parameters
    ----------
    variance : callable
        Integral of the spectrum between lowest and highest wave numbers, (n,) each [m^2].
    wavelengths : tuple of float
        Shortest and longest wavelength [m].
    seed : int
        Seed of the phases.
    name : str
        Name of what the sum is of; others have other phases.
    """
    shortest, longest = wavelengths
    edges = np.geomspace(2.0 * np.pi / longest, 2.0 * np.pi / shortest, N_WAVES + 1)
    power = variance(edges[:-1], edges[1:])
    random = np.random.default_rng([seed, zlib.crc32(name.encode())])
    phases = random.uniform(0.0, 2.0 * np.pi, N_WAVES)
    return np.sqrt(2.0 * power), np.sqrt(edges[:-1] * edges[1:]), phases


@dataclass(frozen=True)
class Sideways:
    """Further data for lateral motion: ``roll_inertia`` [kg m2]; ``stiffness`` [N/m] and
    ``damping`` [N s/m] of one bogie; ``spring_distance`` [m] across the track; ``centre_above``
    [m] of the body's centre of mass over the springs, ``roof_above`` [m] of the roof over it."""

    roll_inertia: float
    stiffness: float
    damping: float
    spring_distance: float
    centre_above: float
    roof_above: float


@dataclass(frozen=True)
class Vehicle:
    """A car body on two bogies.

    Attributes
    ----------
    mass, pitch_inertia : of the body [kg], [kg m2]; it yaws with the same inertia
    stiffness, damping : of the secondary suspension of one bogie, upward [N/m], [N s/m]
    bogie_distance, wheelbase : [m]
    bogie_mass : [kg]; 0 for bogies that follow the track
    primary_stiffness, primary_damping : of one bogie, upward [N/m], [N s/m]
    pantograph_ahead : of pantographs, ahead of the body's centre [m]
    sideways : None if the roof follows the track sideways as it is
    """

    mass: float
    pitch_inertia: float
    stiffness: float
    damping: float
    bogie_distance: float
    wheelbase: float
    bogie_mass: float = 0.0
    primary_stiffness: float = 0.0
    primary_damping: float = 0.0
    pantograph_ahead: float = 0.0
    sideways: Sideways | None = None


class Equations(NamedTuple):
    """M x'' + C x' + K x = B u + D u', u (2,) at the front and the rear bogie; the roof's motion
    is ``roof`` @ x."""

    mass: np.ndarray
    damping: np.ndarray
    stiffness: np.ndarray
    by_place: np.ndarray
    by_rate: np.ndarray
    roof: np.ndarray


def equations_of(vehicle: Vehicle, direction: str) -> Equations | None:
    """Equations of motion of a vehicle in a ``direction``, upward ("vertical") or sideways
    ("lateral"); None if there are none. Not collective."""
    if direction == "vertical":
        return _upward(vehicle)
    return None if vehicle.sideways is None else _sideways(vehicle, vehicle.sideways)


def roof_transfer(
    vehicle: Vehicle, direction: str, wave_numbers: np.ndarray, speed: float
) -> np.ndarray:
    """The roof's motion where the pantograph is, over that of the track there.

    Complex, of the shape of ``wave_numbers`` [rad/m], for sines along the track that are passed at
    ``speed`` [m/s] for ever. Not collective.
    """
    found = equations_of(vehicle, direction)
    if found is None:
        return np.ones(wave_numbers.shape, dtype=complex)
    half = 0.5 * vehicle.bogie_distance
    places = np.array([half, -half]) - vehicle.pantograph_ahead
    k = wave_numbers[..., None, None]
    rate = 1j * k * speed
    track = np.exp(1j * k * places[:, None]) * np.cos(0.5 * k * vehicle.wheelbase)
    dynamic = rate**2 * found.mass + rate * found.damping + found.stiffness
    motion = np.linalg.solve(dynamic, (found.by_place + rate * found.by_rate) @ track)
    return np.asarray(motion[..., 0] @ found.roof)


def roof_course(
    vehicle: Vehicle, direction: str, points: np.ndarray, values: np.ndarray, speed: float
) -> tuple[np.ndarray, np.ndarray]:
    """The roof's course over places along the track, from a course of the track.

    The track is straight beyond the ends of its course, where the vehicle has come from at rest.
    The equations are integrated exactly for a track that is straight within each of the short
    steps. Not collective.

    Parameters
    ----------
    vehicle : Vehicle
        Car body on its suspension.
    direction : str
        "vertical" or "lateral".
    points, values : ndarray
        Points and values of the track, joined by straight lines [m].
    speed : float
        Speed of the train [m/s].

    Returns
    -------
    places : of the pantograph [m], evenly spaced
    motion : of the roof there [m]
    """
    found = equations_of(vehicle, direction)
    if found is None:
        return points, values
    system = _in_time(found)
    fastest = float(np.abs(np.linalg.eigvals(system.A)).max())
    wanted = 2.0 * math.pi * speed / (fastest * _STEPS_PER_WAVE)
    step = min(max(wanted, _SHORTEST), float(np.diff(points).min()))
    reach = 0.5 * (vehicle.bogie_distance + vehicle.wheelbase) + abs(vehicle.pantograph_ahead)
    n = math.ceil((points[-1] - points[0] + reach) / step) + 1
    places = points[0] - reach + step * np.arange(n)
    centres = places - vehicle.pantograph_ahead
    half, axle = 0.5 * vehicle.bogie_distance, 0.5 * vehicle.wheelbase
    track = np.stack(
        [
            np.mean([np.interp(centres + bogie + at, points, values) for at in (axle, -axle)], 0)
            for bogie in (half, -half)
        ],
        axis=1,
    )
    from scipy import signal  # not loaded for vehicles without suspension

    # The vehicle begins at rest on a track of the first height, which is none of its motion.
    rest = values[0]
    _, motion, _ = signal.lsim(system, track - rest, step / speed * np.arange(n))
    return places, rest + np.asarray(motion).reshape(n)


def _in_time(found: Equations) -> signal.StateSpace:
    """The equations with u alone: velocities are counted without what u' gives them."""
    from scipy import signal

    n = len(found.mass)
    inverse = np.linalg.inv(found.mass)
    stiffness, damping = inverse @ found.stiffness, inverse @ found.damping
    place, rate = inverse @ found.by_place, inverse @ found.by_rate
    # With w = x' - M^-1 D u: w' = -M^-1 K x - M^-1 C (w + M^-1 D u) + M^-1 B u.
    a = np.block([[np.zeros((n, n)), np.eye(n)], [-stiffness, -damping]])
    b = np.vstack([rate, place - damping @ rate])
    c = np.append(found.roof, np.zeros(n))[None, :]
    return signal.StateSpace(a, b, c, np.zeros((1, 2)))


def _upward(vehicle: Vehicle) -> Equations:
    half, m = 0.5 * vehicle.bogie_distance, vehicle.bogie_mass
    bogies = 2 if m > 0.0 else 0
    n = 2 + bogies
    masses = np.array([vehicle.mass, vehicle.pitch_inertia, *[m] * bogies])
    damping, stiffness = np.zeros((2, n, n))
    by_place, by_rate = np.zeros((2, n, 2))
    for number, side in enumerate((1.0, -1.0)):
        stretch = np.zeros(n)
        stretch[:2] = 1.0, side * half
        if bogies:
            stretch[2 + number] = -1.0
            stiffness[2 + number, 2 + number] += vehicle.primary_stiffness
            damping[2 + number, 2 + number] += vehicle.primary_damping
            by_place[2 + number, number] = vehicle.primary_stiffness
            by_rate[2 + number, number] = vehicle.primary_damping
        else:
            by_place[:, number] = vehicle.stiffness * stretch
            by_rate[:, number] = vehicle.damping * stretch
        stiffness += vehicle.stiffness * np.outer(stretch, stretch)
        damping += vehicle.damping * np.outer(stretch, stretch)
    roof = np.zeros(n)
    roof[:2] = 1.0, vehicle.pantograph_ahead
    return Equations(np.diag(masses), damping, stiffness, by_place, by_rate, roof)


def _sideways(vehicle: Vehicle, side: Sideways) -> Equations:
    half, square = 0.5 * vehicle.bogie_distance, (0.5 * side.spring_distance) ** 2
    masses = np.diag([vehicle.mass, vehicle.pitch_inertia, side.roll_inertia])
    damping, stiffness = np.zeros((2, 3, 3))
    by_place, by_rate = np.zeros((2, 3, 2))
    for number, end in enumerate((1.0, -1.0)):
        stretch = np.array([1.0, end * half, side.centre_above])
        stiffness += side.stiffness * np.outer(stretch, stretch)
        damping += side.damping * np.outer(stretch, stretch)
        by_place[:, number] = side.stiffness * stretch
        by_rate[:, number] = side.damping * stretch
    stiffness[2, 2] += 2.0 * vehicle.stiffness * square
    stiffness[2, 2] -= vehicle.mass * GRAVITY * side.centre_above
    damping[2, 2] += 2.0 * vehicle.damping * square
    # Points above the centre of mass go to the right where the left side is lifted.
    roof = np.array([1.0, vehicle.pantograph_ahead, -side.roof_above])
    return Equations(masses, damping, stiffness, by_place, by_rate, roof)


@dataclass(frozen=True)
class Spline:
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


Source = Spline | Harmonic | Irregularity


@dataclass(frozen=True)
class VehicleMotion:
    """Sums of sources that move the bases of a train's pantographs, up and to the left.

    What depends on the place is the track, which reaches the bases through a ``suspension``;
    without one they follow it as it is. What depends on time is their own motion in either case.
    """

    vertical: tuple[Source, ...] = ()
    lateral: tuple[Source, ...] = ()
    suspension: Vehicle | None = None


class Motion(NamedTuple):
    """Place [m], velocity [m/s] and acceleration [m/s^2] in one direction."""

    place: float
    velocity: float
    acceleration: float


# A function of one variable with two derivatives.
_Course = Callable[[float], tuple[float, float, float]]


def _natural_spline(points: Sequence[float] | np.ndarray, values: object) -> _Course:
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
    if isinstance(source, Spline):
        if suspension is None or not source.along_track:
            return _natural_spline(source.points, source.values), source.along_track
        return _natural_spline(*_roof_above(source, direction, suspension, speed)), True
    amplitudes, wave_numbers, phases = source.waves(direction)
    if suspension is not None:
        passed = roof_transfer(suspension, direction, wave_numbers, speed)
        amplitudes, phases = amplitudes * np.abs(passed), phases + np.angle(passed)
    return native.sines_at.bound(amplitudes, wave_numbers, phases), True


def _roof_above(
    source: Spline, direction: str, suspension: Vehicle, speed: float
) -> tuple[np.ndarray, np.ndarray]:
    """Places and heights of the roof above a track that follows a spline."""
    from scipy.interpolate import CubicSpline

    spline = CubicSpline(source.points, source.values, bc_type="natural")
    n = int(np.ceil((spline.x[-1] - spline.x[0]) / _FINE)) + 1
    points = np.linspace(spline.x[0], spline.x[-1], max(n, 2))
    return roof_course(suspension, direction, points, spline(points), speed)
