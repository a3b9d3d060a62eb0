"""Regulated lifts: step responses beside scipy.signal, limits, delay, controllers in Python."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from measuring import check
from scipy import signal

from catenary.mbs.build import raising_data
from catenary.mbs.head.laws import Regulation
from catenary.mbs.head.stepping import Stepping
from catenary.mbs.lumped import LumpedData, LumpedPantograph
from catenary.mbs.mechanism.reduction import RaisingPantograph

# A heavy frame that lifts against a wire as stiff as a span, so that its force follows the lift.
DATA = LumpedData((7.2, 15.0), (4200.0, 50.0), (10.0, 90.0))
WIRE, LOSS, DT = 3000.0, 150.0, 1e-3
HEIGHT, FORCE = 5.0, 120.0


def closed_loop(
    regulation: Regulation | None, n: int, dt: float = DT, data: LumpedData = DATA
) -> tuple[np.ndarray, np.ndarray, LumpedPantograph]:
    """Force on a wire that is a spring and a damper to the ground, and the added force, (n,)."""
    one = LumpedPantograph(data, FORCE, HEIGHT, Stepping(0.0, dt))
    one.regulate(regulation)
    zero = HEIGHT - FORCE / WIRE  # the wire unloaded: at rest the head is at its nominal height
    one.place(HEIGHT)
    pressed = FORCE / data.stiffnesses[0]
    one.position[1] += pressed
    one._state[2 * one._n :] = 0.0
    forces, added = np.empty((2, n))
    for number in range(1, n + 1):
        head = one.predict(dt * number)
        free, speed = head.height[0] - zero, head.velocity[0]
        taken = WIRE * head.height_compliance[0, 0] + LOSS * head.velocity_compliance[0, 0]
        force = (WIRE * free + LOSS * speed) / (1.0 + taken)
        one.advance(np.array([force]))
        forces[number - 1], added[number - 1] = force, one.added_force
    return forces, added, one


def plant() -> signal.TransferFunction:
    """From the added force to the force on the wire, in closed form."""
    (m1, m2), (k1, k2), (c1, c2) = DATA.masses, DATA.stiffnesses, DATA.dampings
    head = np.poly1d([m1, c1 + LOSS, k1 + WIRE])
    frame = np.poly1d([m2, c1 + c2, k1 + k2])
    between, wire = np.poly1d([c1, k1]), np.poly1d([LOSS, WIRE])
    return signal.TransferFunction((between * wire).coeffs, (head * frame - between**2).coeffs)


def pi(**changes: object) -> Regulation:
    base = Regulation(False, 150.0, ((0.0, 0.2, 3.0, 0.0),), -200.0, 200.0, DT, 0.05)
    return replace(base, **changes)  # type: ignore[arg-type]


def test_without_a_regulator_the_wire_stays_pressed_with_the_static_force() -> None:
    forces, added, _ = closed_loop(None, 500)
    check("largest change [N]", np.abs(forces - FORCE).max(), 0.0, within=1e-9)
    assert not added.any()


def test_the_step_response_of_a_pi_controller_is_that_of_scipy_signal() -> None:
    """Target 150 N from 120 N: L = P (kp + ki / s) / (1 + 0.05 s), 30 N of L / (1 + L).

    The sampled controller acts a step later, and its integral is one of rectangles: on average
    1.5 steps late. With a slope of the response of at most 300 N/s that is 0.45 N.
    """
    n = 1500
    forces, added, _ = closed_loop(pi(), n)
    wire = plant()
    num = np.polymul(wire.num, [0.2, 3.0])
    den = np.polymul(np.polymul(wire.den, [1.0, 0.0]), [0.05, 1.0])
    # The reference is not filtered, what is measured is: e = r - F y.
    forward = np.polymul(np.polymul(wire.num, [0.2, 3.0]), [0.05, 1.0])
    loop = signal.TransferFunction(forward, np.polyadd(den, num))
    times = DT * np.arange(1, n + 1)
    _, expected = signal.step(loop, T=np.concatenate([[0.0], times]))
    response = forces - FORCE
    assert expected.max() > 0.5
    print(np.abs(np.diff(30.0 * expected)).max() / DT)
    check("largest difference [N]", np.abs(response - 30.0 * expected[1:]).max(), 0.0, within=0.45)
    check("in the end [N]", forces[-1], 120.0 + 30.0 * expected[-1], within=0.02)


def test_the_error_falls_with_the_time_between_samples() -> None:
    """First order: half the step and sample time, half the difference to the continuous loop."""
    wire, errors = plant(), []
    num = np.polymul(wire.num, [0.2, 3.0])
    den = np.polymul(np.polymul(wire.den, [1.0, 0.0]), [0.05, 1.0])
    loop = signal.TransferFunction(np.polymul(num, [0.05, 1.0]), np.polyadd(den, num))
    for dt in (2e-3, 1e-3, 0.5e-3):
        n = round(0.6 / dt)
        forces, *_ = closed_loop(pi(sample_time=dt), n, dt)
        _, expected = signal.step(loop, T=dt * np.arange(n + 1))
        errors.append(float(np.abs(forces - FORCE - 30.0 * expected[1:]).max()))
    print(errors)
    assert 1.8 < errors[0] / errors[1] < 2.3 and 1.8 < errors[1] / errors[2] < 2.3


def test_samples_gains_rate_and_delay_are_those_of_a_digital_controller() -> None:
    """The added force beside the same recursion written down again from the forces themselves."""
    gains = ((100.0, 0.1, 1.0, 0.002), (140.0, 0.3, 3.0, 0.001))
    regulation = pi(gains=gains, sample_time=0.01, filter_time=0.03, delay=0.03, from_time=0.2)
    forces, added, _ = closed_loop(regulation, 1200)
    filtered, integral, last, waiting, acting = forces[0], 0.0, None, [0.0] * 3, 0.0
    expected = []
    for number, force in enumerate(forces, start=1):
        filtered += (1.0 - math.exp(-DT / 0.03)) * (force - filtered)
        if number >= 200 and number % 10 == 0:
            error = 150.0 - filtered
            by_error, by_integral, by_rate = (
                np.interp(filtered, [100.0, 140.0], [row[k] for row in gains]) for k in (1, 2, 3)
            )
            integral += 0.01 * error
            rate = 0.0 if last is None else (error - last) / 0.01
            last = error
            waiting.append(float(by_error * error + by_integral * integral + by_rate * rate))
            acting = waiting.pop(0)
        expected.append(acting)
    assert np.ptp(added) > 5.0 and not added[:229].any()
    check("added force [N]", np.abs(added - expected).max(), 0.0, within=1e-9)


def test_the_force_stays_within_its_limits_and_the_integral_does_not_wind_up() -> None:
    """A target out of reach for 2 s: back within the limits, the force falls at once."""
    regulation = pi(target=400.0, least=-10.0, most=25.0)
    _, added, one = closed_loop(regulation, 2000)
    assert added.max() == 25.0
    assert one._control is not None
    one._control.settings["target"] = 100.0  # a target below
    zero = HEIGHT - FORCE / WIRE
    for number in range(2001, 2400):
        head = one.predict(DT * number)
        taken = WIRE * head.height_compliance[0, 0] + LOSS * head.velocity_compliance[0, 0]
        one.advance(
            np.array([(WIRE * (head.height[0] - zero) + LOSS * head.velocity[0]) / (1.0 + taken)])
        )
        if one.added_force < 24.0:
            break
    assert number < 2100  # wound up, the integral alone would hold for 2 s


def test_gains_beyond_the_stability_limit_swing_up_to_the_limits() -> None:
    """Routh's limit of the integral gain alone, from the closed form, between two tried."""
    wire = plant()

    def grows(gain: float) -> bool:
        num = np.polymul(wire.num, [gain])
        den = np.polymul(np.polymul(wire.den, [1.0, 0.0]), [0.05, 1.0])
        return bool(np.roots(np.polyadd(den, num)).real.max() > 0.0)

    low, high = 1.0, 1000.0
    while high / low > 1.01:
        middle = math.sqrt(low * high)
        low, high = (low, middle) if grows(middle) else (middle, high)
    print("limit", low)
    swings = []
    for gain in (0.5 * low, 2.0 * low):
        forces, *_ = closed_loop(pi(gains=((0.0, 0.0, gain, 0.0),), least=-60.0, most=60.0), 4000)
        swings.append(np.ptp(forces[-1000:]))
    assert swings[0] < 1.0 and swings[1] > 20.0


class Same:
    """A PI controller of one's own, without a filter."""

    def __init__(self) -> None:
        self.integral = 0.0

    def added_force(self, time: float, contact_force: float, head_height: float) -> float:
        error = 150.0 - contact_force
        self.integral += DT * error
        return min(max(0.2 * error + 3.0 * self.integral, -200.0), 200.0)

    def state(self) -> np.ndarray:
        return np.array([self.integral])

    def restore(self, state: np.ndarray) -> None:
        self.integral = float(state[0])


def test_a_controller_in_python_is_called_and_remembers() -> None:
    table, *_ = closed_loop(pi(filter_time=0.0), 400)
    own, added, one = closed_loop(Same, 400)  # type: ignore[arg-type]
    assert one.by_hand
    check("largest difference [N]", np.abs(own - table).max(), 0.0, within=1e-9)
    other = LumpedPantograph(DATA, FORCE, HEIGHT, Stepping(0.0, DT))
    other.regulate(Same)
    other.restore(one.state())
    assert other.added_force == added[-1] == one.added_force
    assert np.array_equal(other.state(), one.state())


@pytest.mark.parametrize("delay", [0.0, 0.02])
def test_the_state_holds_all_that_is_remembered(delay: float) -> None:
    regulation = pi(delay=delay, sample_time=0.01)
    whole, *_ = closed_loop(regulation, 300)
    _, _, one = closed_loop(regulation, 150)
    other = LumpedPantograph(DATA, FORCE, HEIGHT, Stepping(0.0, DT))
    other.regulate(regulation)
    other.restore(one.state())
    zero = HEIGHT - FORCE / WIRE
    for number in range(151, 301):
        head = other.predict(DT * number)
        taken = WIRE * head.height_compliance[0, 0] + LOSS * head.velocity_compliance[0, 0]
        force = (WIRE * (head.height[0] - zero) + LOSS * head.velocity[0]) / (1.0 + taken)
        other.advance(np.array([force]))
        assert force == whole[number - 1]


def test_a_mechanism_is_regulated_by_the_head_s_height() -> None:
    """A wire that gives 1 N/mm: a head that is to be 20 mm higher gets there with 20 N more, and
    with what the mechanism's lift loses on the way."""
    import paper_pantograph as paper

    raising = raising_data(paper.data(), 150.0, HEIGHT)
    one = RaisingPantograph(raising, Stepping(0.0, DT))
    one.regulate(
        Regulation(True, HEIGHT + 0.02, ((0.0, 0.0, 4000.0, 0.0),), -90.0, 90.0, 0.01, 0.02)
    )
    one.place(HEIGHT)
    zero = HEIGHT - 0.15
    for number in range(1, 8001):
        head = one.predict(DT * number)
        taken = 1e3 * head.height_compliance[0, 0] + 300.0 * head.velocity_compliance[0, 0]
        force = (1e3 * (head.height[0] - zero) + 300.0 * head.velocity[0]) / (1.0 + taken)
        one.advance(np.array([force]))
    check("head [m]", one.position[0], HEIGHT + 0.02, within=1e-5)
    check("force [N]", force, 170.0, within=0.02)
    # 170 N press the head's springs further; the lift of an arm that stands higher is lower.
    (_, lift, _), _ = raising.frame.at(one.position[1] - raising.head.offset - raising.base_height)
    check("added [N]", one.added_force, 170.0 - (lift - raising.head.weight), within=0.02)
