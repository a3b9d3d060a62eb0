"""Steps against the formulas they stand for, written out with NumPy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import linalg
from scipy.interpolate import CubicSpline

from catenary import RunBroken
from catenary.mbs.head.laws import Law
from catenary.mbs.head.stepping import LateralPath, Stepping
from catenary.mbs.head.strips import Strips, Suspension, Turning, head_parts
from catenary.mbs.lumped import LumpedData, LumpedPantograph
from catenary.mbs.mechanism.reduction import Head, RaisingData, RaisingPantograph, ReducedMechanism
from catenary.mbs.vehicle import BaseMotion, Harmonic, VehicleMotion

EPS = np.finfo(float).eps
DT, BETA, GAMMA = 2e-3, 0.3, 0.55
THREE = LumpedData((7.5, 9.0, 6.0), (7000.0, 15500.0, 160.0), (45.0, 0.1, 100.0))
HEIGHTS = np.linspace(1.0, 1.8, 9)
FRAME = ReducedMechanism(
    HEIGHTS,
    20.0 + 6.0 * HEIGHTS**2,
    230.0 + 30.0 * np.sin(4 * HEIGHTS),
    60.0 + 9.0 * HEIGHTS,
    20.0 * np.ones_like(HEIGHTS),
    name="tall",
)
RAISING = RaisingData(FRAME, Head(7.8, 6000.0, 26.0, 76.0, 0.08), base_height=3.6)


def newmark(
    state: np.ndarray,
    masses: np.ndarray,
    stiffness: np.ndarray,
    damping: np.ndarray,
    push: np.ndarray,
) -> np.ndarray:
    """A step of M a + C v + K d = push (eqs. 2.5 and 2.6 of the paper) from (d, v, a)."""
    d, v, a = state.reshape(3, -1)
    d = d + DT * v + DT**2 * (0.5 - BETA) * a
    v = v + DT * (1 - GAMMA) * a
    matrix = np.diag(masses) + GAMMA * DT * damping + BETA * DT**2 * stiffness
    a = linalg.solve(matrix, push - stiffness @ d - damping @ v)
    return np.concatenate([d + BETA * DT**2 * a, v + GAMMA * DT * a, a])


def test_lumped_masses_step_as_newmark_s_formulas_say() -> None:
    static, nominal = 120.0, 5.4
    pantograph = LumpedPantograph(THREE, static, nominal, Stepping(0.0, DT, BETA, GAMMA))
    pantograph.place(5.3)
    state = pantograph.state()
    base = nominal + static / 7000.0 + static / 15500.0
    chains = (THREE.chain(THREE.stiffnesses), THREE.chain(THREE.dampings))
    for number in range(200):
        force = 90.0 + 60.0 * np.sin(0.3 * number)
        push = np.array([-force, 0.0, static + 160.0 * base])
        state = newmark(state, np.array(THREE.masses), *chains, push)
        head = pantograph.predict((number + 1) * DT)
        pantograph.advance(np.array([force]))
    # Forces of springs are differences of 15 500 N/m times 5 m, over masses of 6 kg.
    round_off = 200 * EPS * 15500 * 5.4 / 6
    assert pantograph.state()[6:] == pytest.approx(state[6:], abs=round_off)
    assert pantograph.state()[:3] == pytest.approx(state[:3], abs=DT**2 * round_off + 200 * EPS)
    assert head.height - head.height_compliance @ [force] == pytest.approx(state[0], abs=1e-12)
    assert head.velocity - head.velocity_compliance @ [force] == pytest.approx(state[3], abs=1e-9)


def test_a_raising_mechanism_steps_as_its_equation_says() -> None:
    """Tables at the predicted height, by SciPy's splines."""
    pantograph = RaisingPantograph(RAISING, Stepping(0.0, DT, BETA, GAMMA))
    pantograph.place(5.0, velocity=0.2)
    state = pantograph.state()
    mass, lift, slowing = (
        CubicSpline(HEIGHTS, values) for values in (FRAME.masses, FRAME.lifts, FRAME.dampings)
    )
    pair = np.array([[1.0, -1.0], [-1.0, 1.0]])
    for number in range(150):
        force = 140.0 + 60.0 * np.sin(0.3 * number)
        d = state[:2] + DT * state[2:4] + DT**2 * (0.5 - BETA) * state[4:]
        v = state[2:4] + DT * (1 - GAMMA) * state[4:]
        h = d[1] - 3.6 - 0.08
        stiffness, damping = 6000.0 * pair, 26.0 * pair
        speed, slope = v[1], mass(h, 1)
        # Forces without the parts that the matrices give at the prediction.
        push = np.array([-force, lift(h) - 76.0 - slowing(h) * speed - 0.5 * slope * speed**2])
        stiffness[1, 1] -= lift(h, 1)
        damping[1, 1] += slowing(h) + slope * speed
        push[1] += -lift(h, 1) * d[1] + (slowing(h) + slope * speed) * v[1]
        state = newmark(state, np.array([7.8, mass(h)]), stiffness, damping, push)
        head = pantograph.predict((number + 1) * DT)
        pantograph.advance(np.array([force]))
    round_off = 150 * EPS * 6000 * 5.0 / 7.8
    assert pantograph.state()[4:] == pytest.approx(state[4:], abs=round_off)
    assert pantograph.state()[:4] == pytest.approx(state[:4], abs=150 * DT * round_off)
    assert abs(state[1] - 5.0) > 0.01
    assert head.height - head.height_compliance @ [force] == pytest.approx(state[0], abs=1e-11)


def test_a_mechanism_beyond_its_reach_says_where_and_when() -> None:
    pantograph = RaisingPantograph(RAISING, Stepping(0.0, DT))
    pantograph.place(5.3)
    with pytest.raises(RunBroken) as broken:
        for number in range(1000):
            pantograph.predict((number + 1) * DT)
            pantograph.advance(np.array([0.0]))
    time = (number + 1) * DT
    assert str(broken.value).startswith(f"At {time:.4g} s the arm of pantograph 'tall' is at 1.8")
    assert "moves between 1 m and 1.8 m only" in str(broken.value)


def test_prediction_and_compliance_are_what_a_step_does_for_any_forces() -> None:
    """A step is linear in the forces of all strips: differences of steps are exact."""
    strips = Strips(2, 0.5, 1.6, Suspension(1.2, 9000.0, 30.0), Turning(0.4, 300.0, 2.0))
    data = RaisingData(FRAME, Head(7.8, 6000.0, 26.0, 76.0, 0.08), 3.6, strips)
    ends, heads = [], []
    for forces in ([0.0, 0.0], [40.0, 0.0], [0.0, 40.0]):
        pantograph = RaisingPantograph(data, Stepping(0.0, DT, BETA, GAMMA))
        pantograph.place(5.0)
        for number in range(5):
            head = pantograph.predict((number + 1) * DT)
            pantograph.advance(np.array(forces if number == 4 else [60.0, 55.0]))
        ends.append(pantograph.state())
        heads.append(head.height.copy())
    n = pantograph.position.size
    for j in range(2):
        change = (ends[0] - ends[1 + j]) / 40.0
        scale = 4 * EPS * 5.0 / 40.0
        assert head.height_compliance[:, j] == pytest.approx(change[:2], abs=scale)
        assert head.velocity_compliance[:, j] == pytest.approx(change[n : n + 2], abs=10 * scale)
        assert np.array_equal(heads[j], heads[j + 1])
    assert pantograph.position[3] != 0.0  # the uneven forces pitch the head


def test_placed_with_a_velocity_all_masses_have_it_and_dampers_between_them_are_idle() -> None:
    pantograph = LumpedPantograph(THREE, 120.0, 5.5, Stepping(0.0, DT))
    pantograph.place(5.5, velocity=0.3)
    assert np.array_equal(pantograph.velocity, [0.3, 0.3, 0.3])
    base = 5.5 + 120.0 / 7000.0 + 120.0 / 15500.0
    expected = (120.0 + 160.0 * (base - 5.5) - 100.0 * 0.3) / 6.0
    assert pantograph.state()[6:] == pytest.approx([0, 0, expected], abs=4 * EPS * 15500 * 5.5 / 6)


def test_masses_start_with_the_accelerations_of_springs_and_laws() -> None:
    """Newton's law of each mass; springs of 15 500 N/m at 5.4 m leave their round-off."""
    laws = (
        Law(0, 3, False, (-1.0, 0.0, 1.0), (-300.0, 0.0, 500.0)),
        Law(1, 2, True, (-1.0, 0.0, 1.0), (-40.0, 0.0, 40.0)),
        Law(2, 3, True, (-1.0, 0.1, 1.0), (-10.0, 1.0, 91.0)),
    )
    pantograph = LumpedPantograph(replace(THREE, laws=laws), 120.0, 5.5, Stepping(0.0, DT))
    pantograph.place(5.4, velocity=0.3)
    base = 5.5 + 120.0 / 7000.0 + 120.0 / 15500.0
    on_last = 120.0 + 160.0 * (base - 5.4) - 100.0 * 0.3 - (1.0 + 100.0 * 0.2)
    # The first law pulls from 0.1 m below, by its slope there; the second finds no rate between.
    expected = [300.0 * 0.1 / 7.5, 0.0, on_last / 6.0]
    assert pantograph.state()[6:9] == pytest.approx(expected, abs=8 * EPS * 15500 * 5.5 / 6)
    assert np.array_equal(pantograph.state()[:6], [5.4] * 3 + [0.3] * 3)


def test_a_mechanism_starts_with_the_acceleration_of_its_equation() -> None:
    base = BaseMotion(VehicleMotion((Harmonic(0.02, 2.0, 0.3),)), 0.0, 50.0)
    pantograph = RaisingPantograph(RAISING, Stepping(0.0, DT, base=base))
    pantograph.place(5.0, velocity=0.2)
    moved = base.vertical(0.0)
    height, speed = 5.0 - 3.6 - 0.08 - moved.place, 0.2 - moved.velocity
    mass, lift, slowing = (
        CubicSpline(HEIGHTS, values) for values in (FRAME.masses, FRAME.lifts, FRAME.dampings)
    )
    force = lift(height) - 76.0 - slowing(height) * speed - 0.5 * mass(height, 1) * speed**2
    force += (mass(height) - 20.0) * moved.acceleration
    within = 8 * EPS * 6000 * 5.0 / 7.8
    assert pantograph.state()[4:] == pytest.approx([0.0, force / mass(height)], abs=within)
    with pytest.raises(RunBroken, match="At 0 s the arm of pantograph 'tall' is at 2"):
        pantograph.place(5.7)


@pytest.mark.parametrize("suspended", [False, True])
def test_a_head_raised_as_a_whole_strains_no_spring(suspended: bool) -> None:
    own = Suspension(1.5, 8000.0, 20.0) if suspended else None
    strips = Strips(2, 0.56, 1.6, own, Turning(0.5, 400.0, 3.0))
    head = head_parts(8.0, 6000.0, 26.0, strips, Turning(6.6, 673.0, 3.0))
    raised = np.append(head.level, 1.0)
    assert np.abs(head.stiffness @ raised).max() <= 4 * EPS * 24000
    assert np.abs(head.damping @ raised).max() <= 4 * EPS * 100
    assert head.touch @ head.level == pytest.approx([1.0, 1.0])
    assert head.masses @ head.level == pytest.approx(8.0)
    assert linalg.eigvalsh(head.stiffness).min() > -1e-8


def test_strips_heavier_than_their_head_are_refused() -> None:
    with pytest.raises(ValueError, match="strips of 8 kg are part of a head of 8 kg"):
        head_parts(8.0, 1.0, 0.0, Strips(2, 0.5, None, Suspension(4.0, 1.0, 0.0)))


def test_where_the_wire_crosses_a_head_that_cannot_roll_makes_no_difference() -> None:
    path = LateralPath([(np.array([0.0, 100.0]), (0.2, -0.2))], 0.0, (0.0,), 50.0)
    pantographs = (
        LumpedPantograph(THREE, 120.0, 5.5, Stepping(0.0, DT, lateral=path)),
        LumpedPantograph(THREE, 120.0, 5.5, Stepping(0.0, DT)),
    )
    for pantograph in pantographs:
        pantograph.place(5.5)
        pantograph.predict(DT)
        pantograph.advance(np.array([100.0]))
    assert np.array_equal(pantographs[0].state(), pantographs[1].state())
