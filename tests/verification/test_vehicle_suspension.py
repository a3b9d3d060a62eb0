"""Vehicles on a suspension: closed forms of their transfer function, and the same in time."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from measuring import check
from scipy.integrate import solve_ivp

from catenary.mbs.vehicle import (
    GRAVITY,
    BaseMotion,
    Irregularity,
    Sideways,
    Spline,
    Vehicle,
    VehicleMotion,
    equations_of,
    roof_transfer,
)

# Of a coach, after the Manchester benchmarks (S. Iwnicki, Vehicle System Dynamics 30, 1998).
ON_TRACK = Vehicle(
    mass=32e3, pitch_inertia=1.97e6, stiffness=860e3, damping=40e3, bogie_distance=19.0,
    wheelbase=2.56, pantograph_ahead=9.5,
    sideways=Sideways(56.8e3, 320e3, 64e3, 2.0, 0.8, 1.8),
)  # fmt: skip
ON_BOGIES = replace(ON_TRACK, bogie_mass=2615.0, primary_stiffness=4.88e6, primary_damping=16e3)
SPEED = 70.0


def one(vehicle: Vehicle, direction: str, wave_number: float) -> complex:
    return complex(roof_transfer(vehicle, direction, np.array([wave_number]), SPEED)[0])


@pytest.mark.parametrize("waves", [1, 2])
def test_a_wave_that_fits_between_the_bogies_makes_the_body_bounce(waves: int) -> None:
    """Both bogies in step: H = (2 k + 2 i c w) / (2 k + 2 i c w - M w^2), less what wheelsets
    average out, cos(k l / 2); at the front bogie, where the pantograph stands, the phase is none.
    """
    k = 2.0 * math.pi * waves / ON_TRACK.bogie_distance
    w = k * SPEED
    spring = 2.0 * (ON_TRACK.stiffness + 1j * w * ON_TRACK.damping)
    expected = spring / (spring - ON_TRACK.mass * w**2) * math.cos(0.5 * k * ON_TRACK.wheelbase)
    check("roof over track", abs(one(ON_TRACK, "vertical", k) / expected - 1.0), 0.0, within=1e-12)


def test_a_wave_of_twice_the_bogies_distance_makes_the_body_pitch() -> None:
    """Opposite heights: a^2 2 k / (2 a^2 k - I w^2) of the slope, at the front bogie of its height.

    With bogies, each is a mass on its primary springs; all in series.
    """
    k, half = math.pi / ON_BOGIES.bogie_distance, 0.5 * ON_BOGIES.bogie_distance
    w = k * SPEED
    second = ON_BOGIES.stiffness + 1j * w * ON_BOGIES.damping
    first = ON_BOGIES.primary_stiffness + 1j * w * ON_BOGIES.primary_damping
    body = -ON_BOGIES.pitch_inertia * w**2 / (2.0 * half**2)
    # Bogie z and body y at its bogie: (second + body) y = second z,
    # (first + second - m w^2) z = second y + first u.
    y_by_z = second / (second + body)
    z = first / (first + second - ON_BOGIES.bogie_mass * w**2 - second * y_by_z)
    expected = y_by_z * z * math.cos(0.5 * k * ON_BOGIES.wheelbase)
    check("roof over track", abs(one(ON_BOGIES, "vertical", k) / expected - 1.0), 0.0, within=1e-12)


def test_long_waves_pass_and_short_ones_do_not() -> None:
    """Below all own motions the roof is where the track is; sideways as well."""
    for direction in ("vertical", "lateral"):
        assert abs(one(ON_BOGIES, direction, 1e-4) - 1.0) < 1e-4
        assert abs(one(ON_BOGIES, direction, 6.0)) < 0.02


def test_sideways_the_body_rolls_about_its_springs() -> None:
    """A car that is pushed slowly by a steady side force leans outward by
    F h / (2 k b^2 - M g h) about its springs: static stiffness beside the closed form."""
    found, side = equations_of(ON_TRACK, "lateral"), ON_TRACK.sideways
    assert found is not None and side is not None
    force = 1e4
    motion = np.linalg.solve(found.stiffness, [force, 0.0, 0.0])
    lean = (
        -force
        * side.centre_above
        / (
            2.0 * ON_TRACK.stiffness * (0.5 * side.spring_distance) ** 2
            - ON_TRACK.mass * GRAVITY * side.centre_above
        )
    )
    check("roll [rad]", motion[2], lean, within=1e-12)
    sway = 0.5 * force / side.stiffness - side.centre_above * lean
    check("sway [m]", motion[0], sway, within=1e-12)
    check("roof [m]", found.roof @ motion, sway - side.roof_above * lean, within=1e-12)


def in_time(vehicle: Vehicle, course: Spline, places: np.ndarray) -> np.ndarray:
    """The roof at places by an integrator of another kind, from rest far before the course."""
    found = equations_of(vehicle, "vertical")
    assert found is not None
    n, inverse = len(found.mass), np.linalg.inv(found.mass)
    spline = BaseMotion(VehicleMotion((course,)), 0.0, 1.0)
    first, last = course.points[0], course.points[-1]

    def track(place: float) -> tuple[float, float]:
        if not first <= place <= last:
            return course.values[0 if place < first else -1], 0.0
        there = spline.vertical(place)
        return there.place, there.velocity

    def rates(time: float, state: np.ndarray) -> np.ndarray:
        centre = start + SPEED * time - vehicle.pantograph_ahead
        u, du = np.zeros((2, 2))
        for number, end in enumerate((1.0, -1.0)):
            for axle in (0.5, -0.5):
                place = centre + end * 0.5 * vehicle.bogie_distance + axle * vehicle.wheelbase
                height, slope = track(place)
                u[number] += 0.5 * height
                du[number] += 0.5 * SPEED * slope
        force = found.by_place @ u + found.by_rate @ du
        force -= found.damping @ state[n:] + found.stiffness @ state[:n]
        return np.concatenate([state[n:], inverse @ force])

    start = first - 40.0
    times = (places - start) / SPEED
    solved = solve_ivp(
        rates, (0.0, times[-1]), np.zeros(2 * n), t_eval=times, rtol=1e-8, atol=1e-10,
        max_step=0.01,
    )  # fmt: skip
    return np.asarray(found.roof @ solved.y[:n])


@pytest.mark.parametrize("vehicle", [ON_TRACK, ON_BOGIES], ids=["no bogies", "bogies"])
def test_a_course_of_the_track_is_followed_in_time(vehicle: Vehicle) -> None:
    """A hump of 20 mm over 60 m. The track is taken as straight within 0.1 m: its curvature of
    2e-4 1/m times 0.1^2 / 8 is 3e-7 m, and a spline through the roof's places does as well."""
    points = tuple(float(x) for x in np.linspace(0.0, 300.0, 61))
    values = tuple(0.02 * math.exp(-(((x - 100.0) / 15.0) ** 2)) for x in points)
    course = Spline(points, values, along_track=True)
    motion = BaseMotion(VehicleMotion((course,), suspension=vehicle), 0.0, SPEED)
    places = np.linspace(50.0, 290.0, 200)
    found = np.array([motion.vertical(place / SPEED).place for place in places])
    expected = in_time(vehicle, course, places)
    assert np.abs(expected).max() > 0.015
    check("largest difference [m]", np.abs(found - expected).max(), 0.0, within=1e-6)


def test_a_random_track_reaches_the_roof_by_the_transfer_function() -> None:
    """Each wave in its amplitude and phase, for every pantograph where it is; velocity and
    acceleration are derivatives of the place."""
    track = Irregularity("german_low", 3.0, 100.0, seed=3)
    still = VehicleMotion((track,))
    on_springs = replace(still, suspension=ON_BOGIES)
    amplitudes, wave_numbers, phases = track.waves("vertical")
    passed = roof_transfer(ON_BOGIES, "vertical", wave_numbers, SPEED)
    for start, time in ((0.0, 1.3), (-200.0, 2.7)):
        place = start + SPEED * time
        waves = amplitudes * passed * np.exp(1j * (wave_numbers * place + phases))
        found = BaseMotion(on_springs, start, SPEED).vertical(time)
        check("height [m]", found.place, waves.imag.sum(), within=1e-12)
        rates = 1j * wave_numbers * SPEED
        check("velocity [m/s]", found.velocity, (rates * waves).imag.sum(), within=1e-11)
        check("acceleration", found.acceleration, (rates**2 * waves).imag.sum(), within=1e-10)
    # In terms of one number, of the waves that both accelerations are sums of.
    rough, smooth = (np.linalg.norm(of * wave_numbers**2 * amplitudes) for of in (1.0, passed))
    assert smooth < 0.1 * rough  # what suspensions are for


def test_without_data_sideways_the_roof_follows_the_track_there() -> None:
    """A table follows its spline, through points 0.1 m apart."""
    upward_only = replace(ON_TRACK, sideways=None)
    bend = Spline((0.0, 40.0, 80.0, 200.0), (0.0, 0.01, -0.02, 0.0), along_track=True)
    for track in (Irregularity("german_low", 3.0, 100.0, seed=3), bend):
        rigid = VehicleMotion((), (track,))
        expected, found = (
            BaseMotion(motion, 50.0, SPEED).lateral(1.1)
            for motion in (rigid, replace(rigid, suspension=upward_only))
        )
        assert abs(expected.place) > 1e-4
        check("place [m]", found.place, expected.place, within=1e-12)
        check("velocity [m/s]", found.velocity, expected.velocity, within=1e-10)
