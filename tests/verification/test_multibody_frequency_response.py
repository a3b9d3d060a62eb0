"""Linearised systems against closed forms, and against motions of all bodies in time."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import paper_pantograph as paper
import pytest
from constraint_handling import Baumgarte
from measuring import check
from seven_bodies import ARM, HEAD, at_rest, calibrated, pressed
from variable_steps import integrate
from verb_runner import invoke

from catenary import InputError
from catenary.cases.scene.input.case_files import read_toml
from catenary.mbs.build import raising_data
from catenary.mbs.head.stepping import Stepping
from catenary.mbs.head.strips import Strips, Suspension
from catenary.mbs.lumped import LumpedData
from catenary.mbs.mechanism.reduction import RaisingPantograph
from catenary.mbs.response import LinearModel, apparent_mass, chain_model, head_response, linearise
from catenary.mbs.rigid.bodies import SPACE, Body, point
from catenary.mbs.rigid.forces import Gravity, PointForce, SpringDamper
from catenary.mbs.rigid.implicit_steps import Stepper
from catenary.mbs.rigid.joints import Prismatic, Revolute, Spherical
from catenary.mbs.rigid.system import System

G = 9.81
FREQUENCIES = np.array([0.3, 1.0, 4.0, 11.0, 25.0])
OMEGA = 2 * np.pi * FREQUENCIES


def test_one_mass_on_a_spring() -> None:
    """H = 1 / (k - m w^2 + i w c): round-off."""
    mass, stiffness, damping = 7.2, 4200.0, 30.0
    model = chain_model(LumpedData((mass,), (stiffness,), (damping,)))
    expected = 1.0 / (stiffness - mass * OMEGA**2 + 1j * OMEGA * damping)
    found = model.receptance(FREQUENCIES)
    check("H [m/N]", np.abs(found - expected), 0.0, within=1e-14 * np.abs(expected))
    (mode,) = model.modes()
    check("frequency [Hz]", mode.frequency, np.sqrt(stiffness / mass) / (2 * np.pi), within=1e-12)
    ratio = damping / (2 * np.sqrt(stiffness * mass))
    check("damping ratio", mode.damping_ratio, ratio, within=1e-12)
    check("static stiffness [N/m]", static_stiffness(model), stiffness, within=1e-9)
    # Far above resonance the spring hardly matters: k / (m w^2).
    masses = apparent_mass([1000.0], model.receptance([1000.0]))
    within = 2 * (stiffness / (2 * np.pi * 1000) ** 2 + damping / (2 * np.pi * 1000))
    check("apparent mass [kg]", masses.real, mass, within=within)


def static_stiffness(model: LinearModel) -> float:
    """Force upward that it takes to hold the loaded point a metre higher, per metre [N/m]."""
    return float(1.0 / (model.push @ np.linalg.solve(model.stiffness, model.push)))


def two_masses(roll: float = 0.0) -> System:
    """EN 50318's pantograph of bodies on one upright guide, springs as in the lumped chain."""
    upright = {"axis_i": (0, 0, 1), "axis_j": (0, 0, 1), "normal_i": (1, 0, 0),
               "normal_j": (1, 0, 0)}  # fmt: skip
    heights = 1.0, 2.0
    masses = 15.0, 7.2
    compressed = 120.0 + masses[1] * G
    return System(
        (
            Body("frame", masses[0], (0.1, 0.1, 0.1), (0, 0, heights[0])),
            Body("head", masses[1], (0.1, 0.1, 0.1), (0, 0, heights[1])),
        ),
        (
            Prismatic("guide of the frame", SPACE, "frame", **upright),
            Prismatic("guide of the head", SPACE, "head", **upright),
        ),
        (
            Gravity(masses, G),
            SpringDamper("head spring", "frame", "head", stiffness=4200.0,
                         free_length=1.0 + compressed / 4200.0, damping=10.0),
            SpringDamper("frame spring", SPACE, "frame", stiffness=50.0,
                         free_length=1.0, damping=90.0),
            PointForce("lift", "frame", (0, 0, compressed + masses[0] * G)),
            PointForce("wire", "head", (0, 0, -120.0)),
        ),
    )  # fmt: skip


def test_bodies_on_guides_are_the_lumped_chain() -> None:
    """The same system twice: to the differences of forces, eps 300 N / 1e-5 m of 50 N/m."""
    system = two_masses()
    found = linearise(system, system.start(), "head").receptance(FREQUENCIES)
    chain = chain_model(LumpedData((7.2, 15.0), (4200.0, 50.0), (10.0, 90.0)))
    expected = chain.receptance(FREQUENCIES)
    check("H [m/N]", np.abs(found - expected), 0.0, within=1e-7 * np.abs(expected))


def test_two_masses_in_closed_form() -> None:
    """H = (d2 + s1) / (d1 d2 + s1 (d1 + d2)) with d = -m w^2 (+ s2), s = k + i w c."""
    m1, m2, k1, k2, c1, c2 = 7.2, 15.0, 4200.0, 50.0, 10.0, 90.0
    s1, s2 = k1 + 1j * OMEGA * c1, k2 + 1j * OMEGA * c2
    d1, d2 = -m1 * OMEGA**2, s2 - m2 * OMEGA**2
    expected = (d2 + s1) / (d1 * d2 + s1 * (d1 + d2))
    found = chain_model(LumpedData((m1, m2), (k1, k2), (c1, c2))).receptance(FREQUENCIES)
    check("H [m/N]", np.abs(found - expected), 0.0, within=1e-13 * np.abs(expected))


def test_strips_on_springs_of_their_own_are_a_mass_more() -> None:
    """Two strips of 1.1 kg on 5000 N/m each, of a head of 7.2 kg: three masses in a chain."""
    strips = Strips(2, 0.4, suspension=Suspension(1.1, 5000.0, 20.0))
    data = LumpedData((7.2, 15.0), (4200.0, 50.0), (10.0, 90.0), strips)
    chain = LumpedData((2.2, 5.0, 15.0), (1e4, 4200.0, 50.0), (40.0, 10.0, 90.0))
    expected = chain_model(chain)
    found = head_response(data, 120.0).model
    check("H [m/N]", np.abs(found.receptance(FREQUENCIES) / expected.receptance(FREQUENCIES) - 1.0),
          0.0, within=1e-12)  # fmt: skip
    mine, other = ([mode.frequency for mode in model.modes()] for model in (found, expected))
    check("frequencies [Hz]", mine, other, within=1e-9)


def test_hanging_rod_pushed_aside_at_its_end() -> None:
    """I phi'' + m g L / 2 phi = L f: H = L^2 / (m g L / 2 - I w^2), I = m L^2 / 3; no damping."""
    length, mass = 1.2, 2.0
    moment = mass * length**2 / 12
    system = System(
        (Body("rod", mass, (moment, moment, 1e-3 * moment), (0, 0, -length / 2)),),
        (Revolute("hinge", SPACE, "rod", at_j=(0, 0, length / 2)),),
        (Gravity((mass,), G),),
    )
    model = linearise(system, system.start(), "rod", (0, 0, -length / 2), (1, 0, 0))
    expected = length**2 / (mass * G * length / 2 - mass * length**2 / 3 * OMEGA**2)
    found = model.receptance(FREQUENCIES)
    # Differences over 1e-5 rad: 1e-10 of third derivatives, eps 1e5 of round-off.
    check("H [m/N]", np.abs(found - expected), 0.0, within=1e-8 * np.abs(expected))
    (mode,) = model.modes()
    check("frequency [Hz]", mode.frequency, np.sqrt(1.5 * G / length) / (2 * np.pi), within=1e-8)
    check("damping ratio", mode.damping_ratio, 0.0, within=1e-8)
    upright = System(
        system.bodies,
        (Revolute("hinge", SPACE, "rod", (0, 0, -length), (0, 0, -length / 2)),),
        system.forces,
    )
    falling = linearise(upright, upright.start(), "rod", (0, 0, length / 2), (1, 0, 0)).modes()
    rates = sorted(mode.root.real for mode in falling)
    growth = np.sqrt(1.5 * G / length)
    check("growth and decay [1/s]", rates, (-growth, growth), within=1e-7)
    with pytest.raises(InputError, match="do not let body 'rod' move along"):
        linearise(system, system.start(), "rod", (0, 0, -length / 2), (0, 0, 1))


def test_motions_that_nothing_resists_and_nothing_drives_are_left_out() -> None:
    """A link on a ball carries another body by a ball: spins and turns that no spring feels."""
    system = System(
        (Body("link", 1.0, (0.1, 0.1, 0.1)), Body("slider", 2.0, (0.1, 0.1, 0.1), (0.5, 0, 0))),
        (
            Spherical("foot", SPACE, "link", (-0.5, 0, 0), (-0.5, 0, 0)),
            Spherical("top", "link", "slider", (0.5, 0, 0)),
        ),
        (
            SpringDamper("spring", SPACE, "link", (0.5, 0, -1), (0.5, 0, 0), 300.0, 1.0, 5.0),
            SpringDamper("side", SPACE, "link", (0.5, -1, 0), (0.5, 0, 0), 300.0, 1.0),
        ),
    )
    model = linearise(system, system.start(), "link", (0.5, 0, 0))
    print(f"left out: {model.n_left_out} motions of {model.left_out}")
    # The link's spin, and the slider's turns about all axes.
    assert model.n_left_out == 4 and model.left_out == ("link", "slider")
    moment = 0.1 + 0.25 + 2.0  # of the link about its foot, and the slider's 2 kg at 1 m
    expected = 1.0 / (300.0 + 5j * OMEGA - moment * OMEGA**2)
    found = model.receptance(FREQUENCIES)
    check("H [m/N]", np.abs(found - expected), 0.0, within=1e-7 * np.abs(expected))


def test_seven_bodies_have_the_figures_of_the_mechanism() -> None:
    """Lift 240 N/m less a metre higher, under a head on 6000 N/m; frame 25.7 kg, head 7.8 kg.

    Two masses: w^2 near k (1 / M + 1 / m), and 240 / (M + m). They leave out that the head is
    carried along the track: 0.4 % of mass.
    """
    system = pressed(calibrated())
    model = linearise(system, at_rest(system), HEAD)
    for mode in model.modes():
        print(f"{mode.frequency:.4f} Hz, damping ratio {mode.damping_ratio:.4f}, {mode.share:.1e}")
    assert model.left_out == ("upper_link",)
    raising, swinging = (m for m in model.modes() if m.share > 1e-3)
    check("raising [Hz]", raising.frequency, np.sqrt(240 / 33.5) / (2 * np.pi), within=0.005)
    expected = np.sqrt(6000 * (1 / 25.7 + 1 / 7.8)) / (2 * np.pi)
    check("head on its springs [Hz]", swinging.frequency, expected, within=0.004 * expected)
    ratio = 26.0 / 2 * np.sqrt((1 / 25.7 + 1 / 7.8) / 6000.0)
    # 0.2 N s/m of the frame's damper on 26.
    check("its damping ratio", swinging.damping_ratio, ratio, within=0.01 * ratio)
    in_series = 240.0 * 6000.0 / 6240.0
    check("static stiffness [N/m]", static_stiffness(model), in_series, within=0.01 * in_series)
    high = apparent_mass([300.0], model.receptance([300.0]))
    check("apparent mass at 300 Hz [kg]", high.real, 7.8, within=6000 / (2 * np.pi * 300) ** 2)


@pytest.mark.parametrize("frequency", [1.0, 5.0, 12.0])
def test_seven_bodies_swing_as_the_linearised_ones(frequency: float) -> None:
    """All bodies in time under 1 N at one frequency, started on the swing that is predicted.

    Second orders: amplitudes of 1 mm at most, on levers of 1 m, 1e-3 of the amplitude. Were the
    prediction wrong, the difference would swing freely and stay.
    """
    system, size = calibrated(), 1.0
    rest = at_rest(pressed(system))
    model = linearise(pressed(system), rest, HEAD)
    omega = 2 * np.pi * frequency
    (amplitudes,) = model.amplitudes([frequency])
    way = model.ways @ amplitudes * size
    swung = pressed(system, lambda time: 150.0 - size * np.cos(omega * time))
    # Imaginary parts lag behind: x = Re(a exp(i w t)).
    start = rest.moved(way.real).with_velocities((1j * omega * way).real)
    times = np.linspace(0.0, 2.0 / frequency, 33)
    motions = integrate(swung, Baumgarte(), start, times, rtol=1e-9, atol=1e-12).motions
    for body, what in ((HEAD, "head"), (ARM, "arm")):
        heights = np.array([point(motion, body, (0, 0, 0)).value[2] for motion in motions])
        heights -= point(rest, body, (0, 0, 0)).value[2]
        turning = np.exp(-1j * omega * times[:-1])
        found = 2.0 * np.mean(heights[:-1] * turning) / size
        expected = point(rest, body, (0, 0, 0)).jacobian[2] @ way / size
        within = max(1e-3, size * abs(expected)) * abs(expected)
        check(f"{what}'s amplitude [m/N]", abs(found), abs(expected), within=within)
        check(
            f"{what}'s phase [rad]", np.angle(found / expected), 0.0, within=within / abs(expected)
        )


def test_fixed_steps_answer_a_load_as_the_linearised_bodies_do() -> None:
    """The same with steps of 1 ms: the trapezoidal rule takes w for 2 / h tan(w h / 2)."""
    system, frequency, size, dt = calibrated(), 5.0, 1.0, 1e-3
    rest = at_rest(pressed(system))
    model = linearise(pressed(system), rest, HEAD)
    omega = 2 * np.pi * frequency
    seen = 2.0 / dt * np.tan(0.5 * omega * dt)
    (amplitudes,) = model.amplitudes([seen / (2 * np.pi)])
    way = model.ways @ amplitudes * size
    stepper = Stepper(pressed(system, lambda time: 150.0 - size * np.cos(omega * time)), dt)
    stepper.begin(rest.moved(way.real).with_velocities((1j * seen * way).real), 0.0)
    heights = []
    for _ in range(400):
        stepper.step()
        heights.append(stepper.motion.position[rest.numbers[HEAD], 2])
    times = dt * np.arange(1, 401)
    swing = np.array(heights) - rest.position[rest.numbers[HEAD], 2]
    found = 2.0 * np.mean(swing * np.exp(-1j * omega * times))
    expected = model.push @ amplitudes
    check("amplitude [m/N]", abs(found), abs(expected), within=1e-3 * abs(expected))
    check("phase [rad]", np.angle(found / expected), 0.0, within=1e-3)


@pytest.mark.parametrize("frequency", [1.0, 5.0, 12.0])
def test_pantograph_of_the_time_loop_answers_as_the_linearised_bodies(frequency: float) -> None:
    """Head over the reduced mechanism in steps of 1 ms, started on the swing that is predicted.

    It leaves out that the head is carried along the track, 0.4 % of mass; on resonance (5.04 Hz,
    damping ratio 0.069) half of that in frequency is 0.2 % / 0.069 = 3 % of amplitude and phase.
    """
    system, size, dt = calibrated(), 1.0, 1e-3
    rest = at_rest(pressed(system))
    model = linearise(pressed(system), rest, HEAD)
    omega = 2 * np.pi * frequency
    # The trapezoidal rule takes w for 2 / h tan(w h / 2).
    seen = 2.0 / dt * np.tan(0.5 * omega * dt)
    way = model.ways @ model.amplitudes([seen / (2 * np.pi)])[0] * size
    swing = np.array([point(rest, body, (0, 0, 0)).jacobian[2] @ way for body in (HEAD, ARM)])
    pantograph = RaisingPantograph(raising_data(paper.data(), 150.0, 5.08), Stepping(0.0, dt))
    still = np.array([5.08, 5.08 + 150.0 / 6000.0])
    pantograph.restore(
        np.concatenate([still + swing.real, (1j * seen * swing).real, (-(seen**2) * swing).real])
    )
    times, heights = dt * np.arange(1, 2001), []
    for time in times:
        pantograph.predict(time)
        pantograph.advance(np.array([150.0 - size * np.cos(omega * time)]))
        heights.append(pantograph.position[0] - 5.08)
    found = 2.0 * np.mean(np.array(heights) * np.exp(-1j * omega * times))
    within = 0.03 if frequency == 5.0 else 0.01
    check("amplitude [m/N]", abs(found), abs(swing[0]), within=within * abs(swing[0]))
    check("phase [rad]", np.angle(found / swing[0]), 0.0, within=within)


@pytest.mark.study
def test_verb_tells_how_the_seven_bodies_of_the_case_stand(tmp_path: Path) -> None:
    """The same figures from the scene's tables, at the command line; the fit loads as a table."""
    words = ("pantograph", "ambrosio2012", "--kind", "seven_body", "-o", str(tmp_path / "new"))
    result = invoke(*words)
    assert result.exit_code == 0, result.output
    figures = dict(
        re.findall(
            r"^(force of actuator|joint_\d|frame .*?|head .*?)  +(\S+)  ", result.output, re.M
        )
    )
    check("actuator [N]", float(figures["force of actuator"]), 9890.0, within=98.9)
    check("joint 1 [mm]", float(figures["joint_1"]), 5.5, within=0.5)
    frame = figures["frame at the arm (stabilisation_arm)"]
    check("frame [kg]", float(frame), 25.7, within=0.257)
    assert "of upper_link" in result.output
    fragment = read_toml(tmp_path / "new" / "lumped.toml")
    masses = fragment["pantographs"]["seven_body_lumped"]["masses_kg"]
    check("masses [kg]", masses, (7.8, 25.7), within=(0.05, 0.26))


def test_only_rest_is_linearised() -> None:
    system = calibrated()
    with pytest.raises(InputError, match=r"not at rest .* 1\d\d? N are left"):
        linearise(system, at_rest(pressed(system)), HEAD)
    with pytest.raises(InputError, match="no response at one of the frequencies"):
        chain_model(LumpedData((1.0,), (0.0,), (0.0,))).receptance([0.0])
