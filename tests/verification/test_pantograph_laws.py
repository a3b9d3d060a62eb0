"""Laws of pantographs that are not linear: closed forms, an independent integrator, energy."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import paper_pantograph as paper
import pytest
from measuring import check
from scipy.integrate import solve_ivp

from catenary.mbs.build import raising_data
from catenary.mbs.head.laws import Law
from catenary.mbs.head.stepping import Stepping
from catenary.mbs.lumped import LumpedData, LumpedPantograph
from catenary.mbs.mechanism.reduction import RaisingPantograph
from catenary.mbs.vehicle import BaseMotion, Harmonic, VehicleMotion

MASS = 10.0


def limiter(rise: float, stiffness: float, mass: int = 0, below: int = 1) -> Law:
    points, forces = (-1.0, rise, rise + 1.0), (0.0, 0.0, stiffness)
    return Law(mass, below, False, points, forces, of_roof=True)


def damper(up: float, down: float, mass: int = 0, below: int = 1) -> Law:
    return Law(mass, below, True, (-1.0, 0.0, 1.0), (-down, 0.0, up))


def march(
    pantograph: LumpedPantograph | RaisingPantograph,
    dt: float,
    n: int,
    force: Callable[[float], float] = lambda time: 0.0,
) -> np.ndarray:
    """Positions (n, its coordinates), after each step."""
    found = []
    for number in range(1, n + 1):
        pantograph.predict(dt * number)
        pantograph.advance(np.array([force(dt * number)]))
        found.append(pantograph.position.copy())
    return np.array(found)


def test_a_mass_leaves_a_limiter_as_fast_as_it_came() -> None:
    """One-sided spring: deepest by v sqrt(m / k), back at the stop after pi sqrt(m / k).

    Average acceleration takes w dt for 2 atan(w dt / 2): 8e-4 of the half period with w dt = 0.1.
    The step in which the spring is met or left has its force wrong by at most that of the way that
    the predictor misses, which is of order dt^2.
    """
    speed, stiffness, dt = 0.5, 4e4, 1e-4
    w = math.sqrt(stiffness / MASS)
    law = limiter(0.01, stiffness)
    free = LumpedPantograph(
        LumpedData((MASS,), (0.0,), (0.0,), laws=(law,)), 0.0, 5.0, Stepping(0.0, dt)
    )
    free.place(5.0, speed)
    n = round((0.02 / speed + math.pi / w + 0.01) / dt)
    heights = march(free, dt, n)[:, 0] - 5.0
    check("deepest [m]", heights.max() - 0.01, speed / w, within=2e-5)
    inside = dt * np.count_nonzero(heights > 0.01)
    check("time on the stop [s]", inside, math.pi / w, within=2 * dt)
    check("speed afterwards [m/s]", free.velocity[0], -speed, within=2e-4)


def test_the_order_of_a_limiter_is_two() -> None:
    """The height after the bounce at half the step: errors fall to a quarter."""
    errors = []
    for dt in (4e-4, 2e-4, 1e-4):
        law = limiter(0.01, 4e4)
        free = LumpedPantograph(
            LumpedData((MASS,), (0.0,), (0.0,), laws=(law,)), 0.0, 5.0, Stepping(0.0, dt)
        )
        free.place(5.0, 0.5)
        height = march(free, dt, round(0.08 / dt))[-1, 0]
        duration = math.pi / math.sqrt(4e4 / MASS)
        errors.append(abs(height - (5.01 - 0.5 * (0.08 - 0.02 - duration))))
    print(errors)
    assert errors[2] < 0.15 * errors[0]


def test_a_pneumatic_damper_slows_each_way_as_its_half_swing_says() -> None:
    """Half swings with c up and down by turns shrink by exp(-pi z / sqrt(1 - z^2)) each."""
    stiffness, up, down, dt = 4000.0, 80.0, 20.0, 1e-4
    data = LumpedData((MASS,), (stiffness,), (0.0,), laws=(damper(up, down),))
    one = LumpedPantograph(data, 0.0, 5.0, Stepping(0.0, dt))
    one.place(4.9)
    heights = march(one, dt, round(0.7 / dt))[:, 0] - 5.0
    turns = [i for i in range(1, heights.size - 1)
             if (heights[i] - heights[i - 1]) * (heights[i + 1] - heights[i]) <= 0.0]  # fmt: skip
    swings = [-0.1, *heights[turns]]
    for number, (a, b) in enumerate(zip(swings[:-1], swings[1:], strict=True)):
        ratio = (up if number % 2 == 0 else down) / (2.0 * math.sqrt(stiffness * MASS))
        expected = math.exp(-math.pi * ratio / math.sqrt(1.0 - ratio**2))
        check(f"half swing {number + 1}", abs(b / a), expected, within=2e-4)


def test_friction_takes_the_same_from_each_half_swing_and_then_holds() -> None:
    """Coulomb: each half swing is 2 F / k shorter; within F / k of the middle the mass sticks.

    The force builds up over 1 mm/s: sticking means to creep back, k x / (F / 1e-3) = at most
    1e-3 m/s.
    """
    stiffness, force, dt = 4000.0, 12.0, 2e-4
    law = Law(0, 1, True, (-1.0, -1e-3, 1e-3, 1.0), (-force, -force, force, force))
    one = LumpedPantograph(
        LumpedData((MASS,), (stiffness,), (0.0,), laws=(law,)), 0.0, 5.0, Stepping(0.0, dt)
    )
    one.place(4.98)
    heights = march(one, dt, round(1.5 / dt))[:, 0] - 5.0
    lost, half = 2.0 * force / stiffness, math.pi * math.sqrt(MASS / stiffness)
    for number in (1, 2, 3):
        at = round(number * half / dt)
        expected = (0.02 - number * lost) * (-1) ** (number + 1)
        check(f"end of half swing {number} [m]", heights[at], expected, within=2e-4)
    assert np.abs(heights[round(4.2 * half / dt) :]).max() <= force / stiffness


def test_all_laws_at_once_beside_an_independent_integrator() -> None:
    """Two masses, a limiter above the frame, a pneumatic damper on it and a spring that stiffens
    under the head, pushed by a force that swings: positions after each of 3000 steps.

    Average acceleration at 0.2 ms: on the limiter, w = 45 1/s, w^2 dt^2 / 12 = 7e-6 of the phase is
    lost, 2e-4 in 27 rad, 1e-5 m of 50 mm; each of some ten passages of a kink has a step in which
    the force is wrong by a slope times what the segment is late, some 5e-6 m each.
    """
    dt = 2e-4
    laws = (
        limiter(0.03, 3e4, mass=1, below=2),
        damper(200.0, 30.0, mass=1, below=2),
        Law(0, 1, False, (-0.06, -0.03, 0.0, 1.0), (-600.0, -60.0, 0.0, 0.0)),
    )
    data = LumpedData((7.2, 15.0), (4200.0, 50.0), (10.0, 0.0), laws=laws)
    pantograph = LumpedPantograph(data, 120.0, 5.0, Stepping(0.0, dt))
    pantograph.place(4.95)

    def push(time: float) -> float:
        return 40.0 + 110.0 * math.sin(2.0 * math.pi * 2.0 * time)

    found = march(pantograph, dt, 3000, push)
    # At rest the spring that stiffens carries its part, with 60 N over 30 mm.
    masses, pressed = np.array(data.masses), 120.0 / (4200.0 + 2000.0)

    def rates(time: float, state: np.ndarray) -> np.ndarray:
        y, z, vy, vz = state
        head = 4200.0 * (y - z) + 10.0 * (vy - vz)
        extension = y - z
        if extension < -0.03:
            head += -60.0 + 18e3 * (extension + 0.03)
        elif extension < 0.0:
            head += 2000.0 * extension
        stop = 3e4 * max(z - (5.0 + pressed) - 0.03, 0.0)
        slow = (200.0 if vz > 0.0 else 30.0) * vz
        frame = 120.0 + 50.0 * (5.0 + pressed - z) + head - stop - slow
        return np.array([vy, vz, *(np.array([-head - push(time), frame]) / masses)])

    times = dt * np.arange(1, 3001)
    solved = solve_ivp(rates, (0.0, times[-1]), [4.95, 4.95, 0.0, 0.0], t_eval=times,
                       rtol=1e-9, atol=1e-11, max_step=1e-3)  # fmt: skip
    assert np.ptp(solved.y[1]) > 0.05
    assert solved.y[1].max() > 5.0 + pressed + 0.03  # the limiter acts
    check("largest difference [m]", np.abs(found - solved.y[:2].T).max(), 0.0, within=6e-5)


@pytest.mark.parametrize("by", ["steps", "rows"])
def test_a_stop_stands_on_the_roof_while_a_tied_chain_is_raised_with_its_base(by: str) -> None:
    """The base spring's end comes up by 80 mm, the roof swings by 5 mm; beside an integrator.

    The stop is 10 mm above where the head stands under the static force, and acts while the head is
    pulled up alone. Errors as above, of steps of 0.2 ms: 6e-5 m.
    """
    dt, below, raised, swing, rate = 2e-4, 0.05, 0.2, 5e-3, 2.0 * math.pi * 1.5
    laws = (limiter(0.01, 3e4, mass=0, below=2), damper(200.0, 30.0, mass=1, below=2))
    data = LumpedData((7.2, 15.0), (4200.0, 3000.0), (10.0, 0.0), laws=laws)
    base = BaseMotion(VehicleMotion((Harmonic(swing, 1.5, 0.3),)), start=0.0, speed=70.0)
    pantograph = LumpedPantograph(data, 120.0, 5.0, Stepping(raised, dt, base=base))
    pantograph.place(5.0 - below)
    assert data.tied

    def push(time: float) -> float:
        return 60.0 + 200.0 * math.sin(2.0 * math.pi * 2.0 * time)

    n = 4000
    if by == "steps":
        found = march(pantograph, dt, n, push)
    else:
        rows = np.zeros((n, pantograph.row.size))
        pantograph.fill_drives(dt * np.arange(1, n + 1), rows)
        found = np.empty((n, 2))
        for number, row in enumerate(rows, start=1):
            pantograph.stepped.step(row)
            pantograph.advance(np.array([push(dt * number)]))
            found[number - 1] = pantograph.position
    masses, pressed = np.array(data.masses), 120.0 / 4200.0
    way = below + pressed

    def rates(time: float, state: np.ndarray) -> np.ndarray:
        y, z, vy, vz = state
        part, part_rate = 1.0, 0.0
        if time < raised:
            part = 0.5 * (1.0 - math.cos(math.pi * time / raised))
            part_rate = 0.5 * math.pi / raised * math.sin(math.pi * time / raised)
        roof, roof_rate = (
            swing * math.sin(rate * time + 0.3),
            swing * rate * math.cos(rate * time + 0.3),
        )
        end, end_rate = roof - way * (1.0 - part), roof_rate + way * part_rate
        head = 4200.0 * (y - z) + 10.0 * (vy - vz)
        stop = 3e4 * max(y - 5.0 - roof - 0.01, 0.0)
        slow = (200.0 if vz > end_rate else 30.0) * (vz - end_rate)
        lift = 120.0 * part + 3000.0 * (5.0 + pressed + end - z)
        return np.array(
            [vy, vz, *(np.array([-head - stop - push(time), lift + head - slow]) / masses)]
        )

    times = dt * np.arange(1, n + 1)
    at = 5.0 - below
    solved = solve_ivp(rates, (0.0, times[-1]), [at, at, 0.0, 0.0], t_eval=times,
                       rtol=1e-9, atol=1e-11, max_step=1e-3)  # fmt: skip
    over = solved.y[0] - 5.0 - swing * np.sin(rate * times + 0.3)
    assert over.max() > 0.011  # the stop acts
    check("largest difference [m]", np.abs(found - solved.y[:2].T).max(), 0.0, within=6e-5)


@pytest.mark.parametrize(("whole", "part"), [(100.0, 50.0), (6000.0, 0.0)])
def test_a_spring_to_the_base_written_as_a_law_is_a_part_of_the_base_spring(
    whole: float, part: float
) -> None:
    """A linear law counts from the relaxed base spring: both are one spring, to round-off.

    One that holds the chain at a height is raised with its base, by the law alone too.
    """
    law = Law(1, 2, False, (-1.0, 1.0), (part - whole, whole - part))
    found = []
    for stiffness, laws in ((whole, ()), (part, (law,))):
        data = LumpedData((7.2, 15.0), (4200.0, stiffness), (10.0, 90.0), laws=laws)
        assert data.tied == (whole > 1000.0)
        one = LumpedPantograph(data, 120.0, 5.0, Stepping(0.2, 1e-3))
        one.place(4.95)
        found.append(march(one, 1e-3, 500, lambda time: 120.0 + 50.0 * math.sin(20.0 * time)))
    assert np.ptp(found[0][:, 1]) > 0.02
    check("largest difference [m]", np.abs(found[0] - found[1]).max(), 0.0, within=1e-9)


@pytest.mark.parametrize("model", ["chain", "tied chain", "mechanism"])
@pytest.mark.parametrize(
    "forces",
    [
        pytest.param(((-0.05, 0.0), (-400.0, 0.0)), id="beside the spring"),
        pytest.param(((-0.02, -0.01, 0.0), (-900.0, -10.0, 0.0)), id="stiffens"),
        pytest.param(((-1.0, 0.0, 1.0), (20.0, 20.0, 20.0)), id="pulls together"),
    ],
)
def test_a_head_at_its_nominal_height_presses_with_the_static_force(
    model: str, forces: tuple[tuple[float, ...], tuple[float, ...]]
) -> None:
    """A spring that is not linear below the head takes its part of the force at rest.

    The head is pressed by the static force from its nominal height on, and comes back to it: all
    motions fade with 1.8 1/s at least, in 15 s to 2e-12 of 0.03 m. Splines of the mechanism have
    150.0012 N at its working height (`catenary pantograph ambrosio2012`), over 242 N/m 5e-6 m.
    """
    laws = (Law(0, 1, False, *forces), damper(100.0, 100.0, mass=1, below=2), damper(100.0, 100.0))
    dt = 1e-3
    one: LumpedPantograph | RaisingPantograph
    if model == "mechanism":
        raising = raising_data(replace(paper.data(), laws=laws), 150.0, 5.0)
        one, static = RaisingPantograph(raising, Stepping(0.0, dt)), 150.0
    else:
        base = 160.0 if model == "chain" else 4e4
        data = LumpedData((7.2, 15.0), (4200.0, base), (10.0, 0.0), laws=laws)
        one, static = LumpedPantograph(data, 120.0, 5.0, Stepping(0.0, dt)), 120.0
    one.place(5.0)
    found = march(one, dt, 15000, lambda time: static)[-1, 0]
    check("height of the head [m]", found, 5.0, within=1e-5 if model == "mechanism" else 1e-9)


def test_a_law_on_a_mechanism_s_arm_is_what_its_tables_would_hold() -> None:
    """A linear damper written as a law, beside the same in the mechanism's own table of damping."""
    data, dt = paper.data(), 1e-3
    raising = raising_data(data, 150.0, 5.0)
    law = Law(1, 2, True, (-1.0, 1.0), (-70.0, 70.0))
    with_law = raising_data(replace(data, laws=(law,)), 150.0, 5.0)
    frame = replace(raising.frame, dampings=raising.frame.dampings + 70.0)
    pair = [
        RaisingPantograph(one, Stepping(0.0, dt))
        for one in (with_law, replace(raising, frame=frame))
    ]
    found = []
    for one in pair:
        one.place(4.9, 0.3)
        found.append(march(one, dt, 400, lambda time: 150.0 + 50.0 * math.sin(20.0 * time)))
    assert np.ptp(found[0][:, 1]) > 0.02
    check("largest difference [m]", np.abs(found[0] - found[1]).max(), 0.0, within=1e-9)
