"""Vehicles that move under their pantographs: closed forms, all bodies, published spectra."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import paper_pantograph as paper
import pytest
from constraint_handling import Baumgarte
from measuring import History, check, start_march
from scipy import signal
from scipy.integrate import quad
from small_lines import WHOLE, en50318_line, mesh_of, numerics, problem_of, train
from variable_steps import integrate

from catenary.mbs.build import raising_data
from catenary.mbs.head.stepping import LateralPath, Stepping
from catenary.mbs.lumped import LumpedData, LumpedPantograph
from catenary.mbs.mechanism.multibody_pantograph import stand
from catenary.mbs.mechanism.reduction import RaisingPantograph
from catenary.mbs.rigid.bodies import Law
from catenary.mbs.rigid.forces import PointForce
from catenary.mbs.rigid.joints import Constant, Fixed, PrescribedPoint, Prismatic
from catenary.mbs.rigid.statics import equilibrium
from catenary.mbs.vehicle import (
    SPECTRA,
    BaseMotion,
    Harmonic,
    Irregularity,
    Spectrum,
    Spline,
    VehicleMotion,
)

SHORTEST, LONGEST = 3.0, 100.0


def harmonic_base(amplitude: float, frequency: float, phase: float = 0.0) -> BaseMotion:
    vehicle = VehicleMotion((Harmonic(amplitude, frequency, phase),))
    return BaseMotion(vehicle, start=0.0, speed=70.0)


def density_of(spectrum: Spectrum, direction: str, wave_number: np.ndarray) -> np.ndarray:
    """One-sided density [m^3/rad] over wave numbers [rad/m]."""
    square = wave_number**2
    roughness = spectrum.vertical if direction == "vertical" else spectrum.lateral
    corner = spectrum.corner**2
    return roughness * corner / ((square + spectrum.low**2) * (square + corner))


@pytest.mark.parametrize("frequency", [0.5, 1.3, 4.0])
def test_a_mass_on_a_base_that_swings_has_the_textbook_s_transmissibility(frequency: float) -> None:
    """H = (k + i c w) / (k - m w^2 + i c w), amplitude and phase (any book on vibrations).

    Newmark's average acceleration takes w dt for 2 tan(w dt / 2): relative errors of a period of
    (w dt)^2 / 12 = 5e-5 at 4 Hz, magnified near resonance by k / (c w) = 2.
    """
    m, k, c, dt, amplitude, phase = 20.0, 1600.0, 90.0, 1e-3, 0.02, 0.4
    base = harmonic_base(amplitude, frequency, phase)
    pantograph = LumpedPantograph(
        LumpedData((m,), (k,), (c,)), 0.0, 5.0, Stepping(0.0, dt, base=base)
    )
    pantograph.place(5.0)
    settled, n = round(8.0 / dt), round(4.0 / dt)  # 8 s of decay with c / 2 m: exp(-18)
    heights = np.empty(settled + n)
    for number in range(settled + n):
        pantograph.predict(dt * (number + 1))
        pantograph.advance(np.zeros(1))
        heights[number] = pantograph.position[0] - 5.0
    omega, times = 2 * np.pi * frequency, dt * np.arange(settled + 1, settled + n + 1)
    waves = np.column_stack([np.sin(omega * times), np.cos(omega * times)])
    (a, b), *_ = np.linalg.lstsq(waves, heights[settled:], rcond=None)
    expected = (k + 1j * c * omega) / (k - m * omega**2 + 1j * c * omega)
    found = (a + 1j * b) / (amplitude * np.exp(1j * phase))
    check("amplitude ratio", abs(found), abs(expected), within=2 * (omega * dt) ** 2 + 1e-6)
    check("phase [rad]", np.angle(found / expected), 0.0, within=2 * (omega * dt) ** 2 + 1e-6)


def test_the_paper_s_pantograph_on_a_base_that_swings_moves_like_all_its_bodies() -> None:
    """Seven bodies whose base slides up and down as prescribed, head pressed by a constant force.

    What moves the arm is the difference of its equivalent mass, 25.7 kg, and of what the base
    carries along, 32.9 kg. The reduced mechanism leaves out what the head carries along the track,
    0.1 kg of those 7.2 kg, and of the 33.5 kg that move.
    """
    amplitude, frequency, force, end, dt = 0.01, 3.0, 150.0, 0.3, 0.5e-3
    omega, data = 2 * np.pi * frequency, paper.data()
    standing = stand(data)
    joints = tuple(
        Prismatic("track", "space", joint.j, axis_i=(0, 0, 1), axis_j=(0, 0, 1),
                  normal_i=(1, 0, 0), normal_j=(1, 0, 0))
        if isinstance(joint, Fixed) else joint
        for joint in standing.system.joints
    )  # fmt: skip

    def base(t: float) -> Law:
        # Two sines that together start with neither speed nor acceleration.
        one, two = np.array([omega * t, 2 * omega * t]), np.array([1.0, 2.0])
        sizes = amplitude * np.array([1.0, -0.5])
        return Law(
            float(sizes @ np.sin(one)),
            float(sizes @ (omega * two * np.cos(one))),
            float(-sizes @ ((omega * two) ** 2 * np.sin(one))),
        )

    ends, pushed = [], PointForce("wire", data.head, (0.0, 0.0, -force))
    holder = PrescribedPoint("holder", data.arm, Constant(standing.working_height))
    pressed = standing.system.with_forces(pushed)
    rest = equilibrium(pressed.with_joints(holder), standing.motion).motion
    number = rest.numbers[data.head]
    system = replace(standing.system, joints=joints).with_forces(pushed)
    for law in (base, Constant(0.0)):
        moved = system.with_joints(PrescribedPoint("base", joints[0].j, law))
        last = integrate(moved, Baumgarte(), rest, [0.0, end], rtol=1e-8).motions[-1]
        ends.append(last.position[number, 2])
    expected = ends[0] - ends[1]
    head_height = rest.position[number, 2]
    vehicle = VehicleMotion(
        (Harmonic(amplitude, frequency), Harmonic(-0.5 * amplitude, 2 * frequency))
    )
    found = []
    for motion in (BaseMotion(vehicle, 0.0, 70.0), None):
        reduced = raising_data(data, force, head_height)
        pantograph = RaisingPantograph(reduced, Stepping(0.0, dt, base=motion))
        z = head_height + force / reduced.head.stiffness
        pantograph.restore(np.array([head_height, z, 0.0, 0.0, 0.0, 0.0]))
        for step in range(round(end / dt)):
            pantograph.predict(dt * (step + 1))
            pantograph.advance(np.array([force]))
        found.append(pantograph.position[0])
    check(
        "head [m]", found[0] - found[1], expected, within=abs(expected) * (0.1 / 7.2 + 0.1 / 33.5)
    )
    assert abs(expected) > 0.4 * amplitude


@pytest.mark.parametrize("name", SPECTRA)
@pytest.mark.parametrize("direction", ["vertical", "lateral"])
def test_power_of_a_track_is_that_of_its_spectrum(name: str, direction: str) -> None:
    """Of 60 km of track, in bands that are half an octave wide, against the density's integral.

    A band ends within one of the sum's waves, each 3 % wide of the 35 %, at either end.
    """
    spectrum = SPECTRA[name]
    course = Irregularity(name, SHORTEST, LONGEST, seed=7).waves(direction)
    x = np.arange(0.0, 60e3, 0.5)
    heights = sum(a * np.sin(k * x + p) for a, k, p in zip(*course, strict=True))
    cycles, density = signal.periodogram(heights, fs=2.0, window="hann")
    edges = 2 * np.pi / np.geomspace(LONGEST, SHORTEST, 11)

    def wanted(k: float) -> float:
        return float(density_of(spectrum, direction, np.array(k)))

    for low, high in zip(edges, edges[1:], strict=False):
        band = (cycles * 2 * np.pi >= low) & (cycles * 2 * np.pi < high)
        power = density[band].sum() * cycles[1]
        expected = quad(wanted, low, high)[0]
        assert power == pytest.approx(expected, rel=0.12), (low, high)
    whole = quad(wanted, edges[0], edges[-1], limit=200)[0]
    # All power is there; what 60 km do not average are products of neighbouring waves.
    check("variance [m^2]", heights.var(), whole, within=0.01 * whole)
    check("amplitudes [m^2]", 0.5 * (course[0] ** 2).sum(), whole, within=1e-6 * whole)


def test_german_and_american_spectra_have_their_published_values() -> None:
    """At 1 rad/m, by hand from the constants; FRA's are in cm^2 rad/m."""
    one = np.array(1.0)
    by_hand = 0.25 * 0.0339e-4 * 0.8245**2 / (1.0 + 0.8245**2)
    check("class 6", density_of(SPECTRA["fra_6"], "vertical", one), by_hand, within=1e-12 * by_hand)
    by_hand = 4.032e-7 * 0.8246**2 / ((1.0 + 0.0206**2) * (1.0 + 0.8246**2))
    check(
        "low", density_of(SPECTRA["german_low"], "vertical", one), by_hand, within=1e-12 * by_hand
    )
    rough = [float(density_of(SPECTRA[f"fra_{i}"], "vertical", one)) for i in (4, 5, 6)]
    assert rough == sorted(rough, reverse=True)


def test_tracks_of_many_seeds_scatter_as_normal_numbers_of_the_spectrum_s_variance() -> None:
    """The height at one place over 2000 seeds: mean and variance within four standard errors."""
    n, spectrum = 2000, SPECTRA["german_low"]
    variance = quad(
        lambda k: float(density_of(spectrum, "vertical", np.array(k))),
        2 * np.pi / LONGEST, 2 * np.pi / SHORTEST, limit=200,
    )[0]  # fmt: skip
    heights = []
    for seed in range(n):
        a, k, p = Irregularity("german_low", SHORTEST, LONGEST, seed).waves("vertical")
        heights.append(float(a @ np.sin(k * 123.4 + p)))
    sample = np.array(heights)
    check("mean [m]", sample.mean(), 0.0, within=4 * np.sqrt(variance / n))
    check("variance [m^2]", sample.var(), variance, within=4 * variance * np.sqrt(2 / n))


def test_same_seed_same_track_and_directions_are_not_alike() -> None:
    one, same, other = (Irregularity("fra_5", SHORTEST, LONGEST, seed) for seed in (1, 1, 2))
    assert np.array_equal(one.waves("vertical"), same.waves("vertical"))
    assert not np.array_equal(one.waves("vertical")[2], other.waves("vertical")[2])
    assert not np.array_equal(one.waves("vertical")[2], one.waves("lateral")[2])


def test_velocities_and_accelerations_are_derivatives_of_places() -> None:
    """Central differences over 1 ms; a wave of 3 m at 70 m/s has (w h)^2 / 6 = 0.4 % of error."""
    points = tuple(np.linspace(0.0, 500.0, 26))
    vehicle = VehicleMotion(
        (
            Irregularity("fra_6", SHORTEST, LONGEST, 3),
            Harmonic(0.01, 1.2, 0.3),
            Spline(points, tuple(0.05 * np.sin(np.array(points) / 40.0)), along_track=True),
        ),
        (Spline((0.0, 1.0, 2.0, 4.0), (0.0, 0.02, 0.01, 0.03)),),
    )
    base, h = BaseMotion(vehicle, 100.0, 70.0), 1e-3
    for time in (0.5, 1.7, 2.9):
        for way in (base.vertical, base.lateral):
            before, now, after = (way(time + k * h) for k in (-1, 0, 1))
            speed = (after.place - before.place) / (2 * h)
            push = (after.velocity - before.velocity) / (2 * h)
            assert now.velocity == pytest.approx(speed, abs=0.01 * abs(speed) + 1e-4)
            assert now.acceleration == pytest.approx(push, abs=0.01 * abs(push) + 1e-2)
    # The same track, 30 m on: passed 30 / 70 s later by a pantograph 30 m behind.
    track = VehicleMotion((Irregularity("fra_6", SHORTEST, LONGEST, 3),))
    leading, trailing = BaseMotion(track, 100.0, 70.0), BaseMotion(track, 70.0, 70.0)
    assert leading.vertical(1.0).place == pytest.approx(
        trailing.vertical(1.0 + 30 / 70).place, abs=1e-12
    )


def test_a_vehicle_that_sways_moves_the_wire_on_the_strip_the_other_way() -> None:
    base = BaseMotion(VehicleMotion((), (Harmonic(0.05, 2.0),)), 100.0, 70.0)
    path = LateralPath([(np.array([0.0, 1e3]), (0.2, -0.2))], 100.0, (0.3,), 70.0, base)
    path.move_to(0.4)
    along = 100.0 + 0.3 + 28.0
    sway, omega = 0.05 * np.sin(4 * np.pi * 0.4), 4 * np.pi
    check("place [m]", path.place[0], 0.2 - 0.4 * along / 1e3 - sway, within=1e-14)
    rate = -0.4 / 1e3 * 70.0 - 0.05 * omega * np.cos(omega * 0.4)
    check("rate [m/s]", path.rate[0], rate, within=1e-13)


def test_a_vehicle_that_stands_higher_throughout_is_a_base_that_does() -> None:
    """In a march: both put the spring on the base 0.1 m higher. Round-off of forces of 200 N."""
    line = en50318_line(3)
    runs = []
    higher = VehicleMotion((Spline((0.0, 200.0), (0.1, 0.1), along_track=True),))
    for vehicle, height, more in ((higher, 5.4, {"vehicle_motion"}), (None, 5.5, set())):
        ours = replace(train(70.0, 30.0, 120.0, nominal_height=height), vehicle=vehicle)
        problem = problem_of(line, WHOLE | more, train=ours, numerics=numerics(2e-3))
        march, _ = start_march(problem, mesh_of(line, 4))
        runs.append(History())
        assert march.run([runs[-1]]).outcome == "done"
        march.destroy()
    check("force [N]", runs[0]["contact_force"], runs[1]["contact_force"], within=1e-8)
    assert runs[0]["contact_force"].max() > 100.0
