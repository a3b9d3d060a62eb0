"""Group velocities, Doppler factor and energies that are measured, against theory."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from measuring import check
from mpi4py import MPI
from scenes import load_scene
from small_lines import (
    BARE,
    EN_CONTACT_WIRE,
    WHOLE,
    bare_wires,
    en50318_line,
    mesh_of,
    problem_of,
    train,
)

from catenary.cases.studies.asked import Excited
from catenary.cases.studies.waves.seen import (
    EnergyMotion,
    EnergySeen,
    TakesMotion,
    WireMotion,
    arrived,
    measured_rows,
    transmitted,
)
from catenary.cases.studies.waves.study import Watch, excitation_of, study_excited, without_train
from catenary.cases.studies.waves.theory import wave_theory
from catenary.mbs.lumped import LumpedData
from catenary.meshgen.mesh import CONTACT_WIRE
from catenary.solver.problem.contact_laws import LinearLaw
from catenary.solver.statics.line_at_rest import LineAtRest, line_at_rest
from catenary.solver.time_loop.march import March
from catenary.solver.waves.excitation import Blow, Excitation, MovingForce
from catenary.solver.waves.excitation_load import load_of

SPEED = EN_CONTACT_WIRE.wave_speed


def march(
    rest: LineAtRest, excitation: Excitation, every: float, seen: Sequence[TakesMotion]
) -> None:
    """March to the end and show the motion each ``every`` seconds."""
    dt = rest.problem.numerics.dt
    rest.model.loads.append(load_of(excitation, rest.model, dt))
    with March(MPI.COMM_SELF, *rest) as run:
        assert run.run([Watch(max(1, round(every / dt)), seen)]).outcome == "done"


def test_the_energy_of_a_band_arrives_at_its_mean_group_velocity() -> None:
    """A signal that is delayed by d k(w), w^2 = c^2 k^2 (1 + k^2 l^2), with c_g = dw/dk."""
    time = 1e-3 * np.arange(12_000)
    bend, distance = 0.8, 300.0
    k = np.linspace(0.0, 3.0, 4000)
    omega = SPEED * k * np.sqrt(1.0 + (k * bend) ** 2)
    nu = np.fft.rfftfreq(time.size, 1e-3)
    first = np.exp(-0.5 * ((time - 2.0) / 0.02) ** 2)
    delayed = np.fft.rfft(first) * np.exp(-1j * distance * np.interp(2 * np.pi * nu, omega, k))
    second = np.fft.irfft(delayed, time.size)
    velocity = np.gradient(omega, k)
    for frequency in (4.0, 12.0):
        found = arrived(time, first, second, distance, frequency, 0.3)
        expected = found.expected(omega / (2 * np.pi), velocity)
        check(f"{frequency} Hz [m/s]", found.velocity, expected, within=1e-4 * expected)
        assert found.velocity > SPEED


@pytest.mark.study
def test_group_velocities_of_a_periodic_line_are_those_of_its_bloch_waves() -> None:
    """Within 1 % near 6 and 18 Hz.

    A step of average acceleration slows waves of w by (w dt)^2 / 4, 0.3 % at 18 Hz.
    """
    line = en50318_line(44)
    problem = problem_of(line, WHOLE)
    struck = excitation_of("hammer", Excited(impulse=0.2), problem, 1e-3)
    rest = line_at_rest(without_train(problem, struck), mesh_of(line, 8))
    wire = WireMotion(rest.model.contact_nodes, rest.model.contact_x)
    march(rest, struck, 4e-3, [wire.add])
    seen = wire.seen(lambda times: np.zeros((times.size, 0)), 22 * 60.0)
    theory = wave_theory(rest.problem, rest)
    found = measured_rows(theory, seen, transmitted(theory, seen))
    rows = {row["name"]: row["value"] for row in found}
    assert len(rows) == 5
    for number in (1, 2):
        expected = rows[f"group_velocity_{number}_theory"]
        assert 110.0 < expected < 118.0
        check("group velocity [m/s]", rows[f"group_velocity_{number}"], expected,
              within=0.01 * expected)  # fmt: skip
    # Were the line to start five spans before the blow, its echo would be in the record.
    near = replace(seen, x=seen.x.copy())
    near.x[0] = seen.struck - 300.0
    left = {row["name"] for row in measured_rows(theory, near, transmitted(theory, near))}
    assert left == {"energy_in_pass_bands"}


@pytest.mark.process
def test_a_rail_sends_energy_at_its_group_velocity(tmp_path: Path) -> None:
    """It rings on at 4.2 and 8.5 Hz, where waves stand, and its ends send waves back before the
    slowest one has come to them: with both the centre of energy came after twice the time.

    Average acceleration slows waves of 6.4 Hz by (w dt)^2 / 4 = 0.04 %.
    """
    own = ["line.n_spans=60", "evaluation.from_m=85", "evaluation.to_m=93.5"]
    text, _ = study_excited(load_scene("conductor_rail", own), "hammer", Excited(), tmp_path, False)
    found = [line for line in text.splitlines() if line.startswith("group velocity")]
    assert len(found) == 2, text
    seen, expected = (float(line.split()[-2]) for line in found)
    check("group velocity [m/s]", seen, expected, within=0.005 * expected)


@pytest.mark.study
def test_what_passes_lies_in_the_pass_bands() -> None:
    """Within 0.1 Hz, the resolution of 12 s: the second station is 9 spans beyond the first one.

    In the middle of a wide gap next to nothing comes: what the record's end lets spill over.
    """
    line = en50318_line(44)
    problem = problem_of(line, WHOLE - {"dropper_slackening"})
    struck = excitation_of("hammer", Excited(impulse=0.2), problem, 1e-3)
    rest = line_at_rest(without_train(problem, struck), mesh_of(line, 4))
    wire = WireMotion(rest.model.contact_nodes, rest.model.contact_x)
    march(rest, struck, 4e-3, [wire.add])
    seen = wire.seen(lambda times: np.zeros((times.size, 0)), 22 * 60.0)
    found = transmitted(wave_theory(rest.problem, rest), seen)
    assert found is not None and len(found.bands) > 8
    print(f"share in the pass bands {found.inside:.4f}")
    assert found.inside > 0.985
    gaps = np.column_stack([found.bands[:-1, 1], found.bands[1:, 0]])
    wide = gaps[np.diff(gaps, axis=1)[:, 0] > 0.4]
    assert len(wide) > 2
    for low, high in wide:
        middle = np.abs(found.frequency - 0.5 * (low + high)) < 0.05
        print(f"gap {low:.2f} to {high:.2f} Hz: {found.second[middle].max():.1e} of the largest")
        assert found.second[middle].max() < 2e-2


@pytest.mark.study
def test_a_moving_force_sends_waves_by_doppler_and_energy_by_its_factor() -> None:
    """A force F cos(p t) at v on a string: waves of p / (1 - v/c) ahead and p / (1 + v/c) behind.

    Both have the same amplitude, as the wire does not break. Their energies go with the square of
    the frequency and the length of wire that they have reached, (c - v) t and (c + v) t: ahead is
    (c + v) / (c - v) times behind.
    """
    length, speed, frequency = 1200.0, 60.0, 1.5
    wire = replace(EN_CONTACT_WIRE, bending_stiffness=1e-3)
    line = bare_wires(length, contact_wire=wire)
    course = train(speed, 500.0, 500.0 + 4.0 * speed, raise_time=0.0)
    problem = problem_of(line, BARE, train=course)
    moving = MovingForce(100.0, frequency, 500.0, speed, 0.5)
    rest = line_at_rest(without_train(problem, moving), mesh_of(line, 1200))
    motion, energy = WireMotion(rest.model.contact_nodes, rest.model.contact_x), EnergyMotion(rest)
    march(rest, moving, 5e-3, [motion.add, energy.add])
    seen = motion.seen(lambda times: (500.0 + speed * times)[:, None])
    late = seen.time > 2.5
    found = []
    for place in (seen.position[-1, 0] + 30.0, 400.0):
        signal = seen.velocity[late, np.argmin(np.abs(seen.x - place))].astype(float)
        found.append(_frequency(seen.time[late], signal))
    ahead, behind = frequency / (1 - speed / SPEED), frequency / (1 + speed / SPEED)
    # Average acceleration and elements of 1 m: (w dt)^2 / 12 and (k h)^2 / 24, below 1e-3.
    check("frequency ahead [Hz]", found[0], ahead, within=2e-3 * ahead)
    check("frequency behind [Hz]", found[1], behind, within=2e-3 * behind)
    check("Doppler factor", found[1] / found[0], (SPEED - speed) / (SPEED + speed), within=2e-3)
    seen_energy = energy.seen()
    places = (500.0 + speed * seen_energy.time)[:, None]
    before, between, beyond = seen_energy.parts(places)
    np.testing.assert_allclose(before + between + beyond, seen_energy.total, rtol=1e-6)
    # While the force grows over 0.5 s of 4 s, and in what is no whole wave: some per cent.
    ratio = beyond[-1] / before[-1]
    check("energy ahead / behind", ratio, (SPEED + speed) / (SPEED - speed), within=0.05 * ratio)


def _frequency(time: np.ndarray, signal: np.ndarray) -> float:
    """Frequency [Hz] of the sine that fits a signal best."""
    best, apart = 3.0, 0.05
    for tried in (np.arange(0.3, 6.0, apart), np.arange(-apart, apart, 1e-3)):
        left = []
        for nu in (tried if tried[0] > 0.0 else best + tried).tolist():
            basis = np.column_stack([np.cos(2 * np.pi * nu * time), np.sin(2 * np.pi * nu * time)])
            weights, *_ = np.linalg.lstsq(basis, signal, rcond=None)
            left.append((float(((signal - basis @ weights) ** 2).sum()), nu))
        best = min(left)[1]
    return best


@pytest.mark.parametrize("axis", [1, 2])
def test_a_standing_wave_keeps_its_energy(axis: int) -> None:
    """T k^2 A^2 L / 4 at all times, of one wire, also across the track; snapshots dt apart take
    (w dt)^2 / 4 of it and (w dt)^2 / 12 in turn."""
    length, dt, amplitude = 100.0, 0.01, 0.02
    wire = replace(EN_CONTACT_WIRE, bending_stiffness=1e-3)
    line = bare_wires(length, contact_wire=wire)
    effects = BARE | ({"lateral_motion"} if axis == 1 else set())
    rest = line_at_rest(problem_of(line, effects), mesh_of(line, 100))
    nodes = rest.mesh.wires[CONTACT_WIRE]
    k = 4 * np.pi / length
    omega = SPEED * k
    energy = EnergyMotion(rest)
    for time in (dt * np.arange(60)).tolist():
        moved = np.zeros((rest.mesh.n_nodes, 3))
        moved[nodes, axis] = amplitude * np.sin(k * rest.mesh.x(nodes)) * np.cos(omega * time)
        energy.add(time, moved)
    seen = energy.seen()
    expected = EN_CONTACT_WIRE.tension * k**2 * amplitude**2 * length / 4
    within = ((omega * dt) ** 2 / 4 + 1e-4) * expected
    check("energy [J]", seen.total, expected, within=within)
    before, _, beyond = seen.parts(np.full((seen.time.size, 1), 50.0))
    # The node in the middle counts on one side: its share of the energy is 1e-2 sin^2(k h / 2).
    np.testing.assert_allclose(before, beyond, rtol=2e-4)


@pytest.mark.parametrize(("end", "left"), [(0.0, 0), (0.2, 2), (0.29, 2), (0.3, 3)])
def test_energies_between_snapshots_end_with_the_last_one_before_a_change(
    end: float, left: int
) -> None:
    seen = EnergySeen(np.array([0.05, 0.15, 0.25]), np.zeros(1), np.ones((3, 1)))
    assert seen.until(end).total.size == left


def test_slack_droppers_hold_what_their_weights_do() -> None:
    """A contact wire lifted by u, all droppers slack: N u - N^2 / 2k of each dropper, k u^2 / 2 of
    each arm, and (1.2 T / h + 12 EI / h^3) u^2 / 2 of each end element, whose end is held."""
    line = en50318_line(5)
    rest = line_at_rest(problem_of(line, WHOLE), mesh_of(line, 2))
    energy, lift = EnergyMotion(rest), 0.3
    moved = np.zeros((rest.mesh.n_nodes, 3))
    moved[rest.mesh.wires[CONTACT_WIRE], 2] = lift
    for time in (0.0, 1.0):
        energy.add(time, moved)
    tension, k = rest.form.dropper_force, rest.model.dropper_stiffness
    arms = 0.5 * line.steady_arm.stiffness * lift**2 * rest.mesh.steady_arms.size
    h, wire = 2.5, EN_CONTACT_WIRE
    end = 0.5 * (1.2 * wire.tension / h + 12 * wire.bending_stiffness / h**3) * lift**2
    held = float((tension * lift - 0.5 * tension**2 / k).sum()) + arms + 2 * end
    check("energy [J]", energy.seen().total[0], held, within=1e-9 * held)


@pytest.mark.study
def test_a_head_of_fixed_height_amplifies_an_oncoming_wave_by_the_doppler_factor() -> None:
    """What comes back from it is (c - v) / (c + v) as long, and moves as much faster.

    The head is a mass of 1e9 kg without a spring; its contact pulls as well. A contact of K sends
    back 1 / (1 + 2 i p Z / K) of waves of p as the head meets them: within 2 p Z / K = 0.01
    at 5 Hz.
    """
    length, speed, struck = 900.0, 60.0, 600.0
    wire = replace(EN_CONTACT_WIRE, bending_stiffness=1e-3)
    line = bare_wires(length, contact_wire=wire)
    heavy = LumpedData((1e9,), (0.0,), (0.0,))
    course = train(speed, 250.0, 250.0 + 3.9 * speed, data=heavy, static_force=0.0)
    problem = problem_of(line, BARE, train=course, contact=LinearLaw(1e6, 0.0))
    rest = line_at_rest(problem, mesh_of(line, 1800))
    motion = WireMotion(rest.model.contact_nodes, rest.model.contact_x)
    march(rest, Blow(struck, 0.2, 100.0, False), 2e-3, [motion.add])
    seen = motion.seen(lambda times: (250.0 + speed * times)[:, None])
    # Half way between blow and head; what the blow sends to the far end is not back by then.
    station = int(np.argmin(np.abs(seen.x - 550.0)))
    signal = seen.velocity[:, station].astype(float)
    met = (struck - 250.0) / (SPEED + speed)
    came, back = signal[seen.time < met], signal[seen.time >= met]
    factor = (SPEED - speed) / (SPEED + speed)
    ratio = np.abs(back).max() / np.abs(came).max()
    check("velocity back over velocity in", ratio, 1.0 / factor, within=0.02 / factor)
    # Turned over: with the force the wire rises, behind the head's echo it is where it was.
    assert came[np.abs(came).argmax()] > 0.0 > back[np.abs(back).argmax()]
    reflection = wave_theory(rest.problem, rest).reflection
    amplification = wave_theory(rest.problem, rest).amplification
    check("amplification", reflection * ratio, amplification, within=0.02 * amplification)
