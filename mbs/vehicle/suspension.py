"""A vehicle on its suspension: what of the track's irregularity reaches the roof.

A car body stands on two bogies by its secondary suspension, a bogie on the mean of its two
wheelsets by its primary one. Everything is linear, so that upward and sideways motion do not meet:

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
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from scipy import signal

GRAVITY = 9.81
# Steps of a wave of the fastest own motion, where a course of the track is followed in time, and
# the shortest step [m].
_STEPS_PER_WAVE, _SHORTEST = 40, 0.01


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


class Matrices(NamedTuple):
    """M x'' + C x' + K x = B u + D u', u (2,) at the front and the rear bogie; the roof's motion
    is ``roof`` @ x."""

    mass: np.ndarray
    damping: np.ndarray
    stiffness: np.ndarray
    by_place: np.ndarray
    by_rate: np.ndarray
    roof: np.ndarray


def matrices(vehicle: Vehicle, direction: str) -> Matrices | None:
    """Equations of motion of a vehicle in a ``direction``, upward ("vertical") or sideways
    ("lateral"); None if there are none. Not collective."""
    if direction == "vertical":
        return _upward(vehicle)
    return None if vehicle.sideways is None else _sideways(vehicle, vehicle.sideways)


def transfer(
    vehicle: Vehicle, direction: str, wave_numbers: np.ndarray, speed: float
) -> np.ndarray:
    """The roof's motion where the pantograph is, over that of the track there.

    Complex, of the shape of ``wave_numbers`` [rad/m], for sines along the track that are passed at
    ``speed`` [m/s] for ever. Not collective.
    """
    found = matrices(vehicle, direction)
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
    found = matrices(vehicle, direction)
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


def _in_time(found: Matrices) -> signal.StateSpace:
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


def _upward(vehicle: Vehicle) -> Matrices:
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
    return Matrices(np.diag(masses), damping, stiffness, by_place, by_rate, roof)


def _sideways(vehicle: Vehicle, side: Sideways) -> Matrices:
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
    return Matrices(masses, damping, stiffness, by_place, by_rate, roof)
