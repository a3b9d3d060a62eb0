"""Fixed steps of multibody systems: closed forms, observed order, joints that stay closed."""

from __future__ import annotations

import numpy as np
import pytest
from body_mechanics import rod
from driven_angle import DrivenAngle
from measuring import check, print_table
from scipy.special import ellipk
from studies import few

from catenary import RunBroken
from catenary.mbs.rigid.bodies import SPACE, Body, Motion, point
from catenary.mbs.rigid.forces import BumpStop, Gravity, PointForce, SpringDamper
from catenary.mbs.rigid.implicit_steps import METHODS, Augmented, Partitioned, Stepper, WithFeedback
from catenary.mbs.rigid.joints import Prismatic, Revolute, Spherical, steady
from catenary.mbs.rigid.system import System

G = 9.81
each_method = pytest.mark.parametrize("method", METHODS)
# Multipliers that are augmented take the longest over many steps.
most_methods = pytest.mark.parametrize(
    "method", few(METHODS, "coordinate_partitioning", "baumgarte")
)


def pendulum(length: float) -> System:
    return System(
        (rod("rod", 2.0, length, length / 2),),
        (Revolute("hinge", SPACE, "rod", at_j=(-length / 2, 0, 0)),),
        (Gravity((2.0,), G),),
    )


@most_methods
def test_pendulum_that_swings_far_is_back_after_its_period(method: str) -> None:
    """A rod let go level, T = 4 K(sin 45 deg) sqrt(2 L / (3 g)): order 2; joints as stated.

    Where errors are removed 1e-12 m is left. Feedback leaves what a step's prediction is wrong by,
    w^3 L h^3 / 6 with w below 6 rad/s, h = 4.4 ms: 3e-6 m; it is taken back at once.
    """
    length = 1.2
    period = 4 * ellipk(0.5) * np.sqrt(2 * length / (3 * G))
    system, counts, errors, opened = pendulum(length), [100, 200, 400, 800], [], 0.0
    for count in counts:
        stepper = Stepper(system, period / count, method)
        stepper.begin(system.start(), 0.0)
        opened = 0.0
        for _ in range(count):
            stepper.step()
            opened = max(opened, stepper.violation())
        tip = point(stepper.motion, "rod", (length / 2, 0, 0)).value
        errors.append(float(np.linalg.norm(tip - (length, 0, 0))))
    print(f"joints open by {opened:.1e} m")
    observed = print_table(f"{method}: tip after a period [m], by steps", counts, errors)
    # Back at rest, the tip's error grows with the square of the error in time as well.
    assert observed[-1] > 1.9
    assert opened < (3e-6 if method == "baumgarte" else 1e-11)


@most_methods
def test_prescribed_slider_crank_follows_its_closed_form(method: str) -> None:
    """x = r cos wt + sqrt(l^2 - r^2 sin^2 wt): no freedom at all, and a row too many."""
    r, length, speed, dt = 0.3, 0.8, 5.0, 1e-3
    system = System(
        (
            rod("crank", 1.0, r, r / 2),
            rod("link", 1.0, length, r + length / 2),
            Body("slider", 2.0, (0.01, 0.01, 0.01), (r + length, 0, 0)),
        ),
        (
            Revolute("main", SPACE, "crank", at_j=(-r / 2, 0, 0)),
            Revolute("pin", "crank", "link", (r / 2, 0, 0), (-length / 2, 0, 0)),
            Spherical("gudgeon", "link", "slider", (length / 2, 0, 0)),
            Prismatic("guide", SPACE, "slider"),
            DrivenAngle("drive", SPACE, "crank", steady(0.0, speed)),
        ),
    )
    assert system.redundant(system.start()) == ("guide (1)",)
    stepper = Stepper(system, dt, method)
    stepper.begin(system.start(), 0.0)
    found = []
    for _ in range(1000):
        stepper.step()
        found.append((stepper.motion.position[2, 0], stepper.motion.velocity[2, 0]))
    turn = speed * dt * np.arange(1, 1001)
    root = np.sqrt(length**2 - (r * np.sin(turn)) ** 2)
    expected = r * np.cos(turn) + root
    velocity = -r * speed * np.sin(turn) * (1 + r * np.cos(turn) / root)
    # Removed errors leave 1e-12; feedback r w^3 h^3 / 6 of the prediction, and that / h a second.
    within = 6 * r * (speed * dt) ** 3 / 6 if method == "baumgarte" else 1e-10
    check("slider [m]", [x for x, _ in found], expected, within=within)
    check("its velocity [m/s]", [v for _, v in found], velocity, within=max(1e-9, within / dt))


def test_free_body_tumbles_with_order_two_and_keeps_its_momentum_to_it() -> None:
    """Without joints: L in space is constant. Spun at 4 rad/s near its middle axis."""
    inertia = np.array([1.0, 2.0, 3.0])
    system = System((Body("box", 2.0, inertia),), ())
    start = system.start().with_velocities(np.array([0, 0, 0, 0.1, 4.0, 0.1]))
    counts, errors = [250, 500, 1000], []
    for count in counts:
        stepper = Stepper(system, 2.0 / count)
        stepper.begin(start, 0.0)
        for _ in range(count):
            stepper.step()
        momentum = stepper.motion.rotation[0] @ (inertia * stepper.motion.spin[0])
        errors.append(float(np.linalg.norm(momentum - inertia * start.spin[0])))
    observed = print_table("L after 2 s [kg m^2/s], by steps", counts, errors)
    check("order", observed[-1], 2.0, within=0.1)


def oscillator(stiffness: float, damping: float, above: float = 0.06) -> tuple[System, Motion]:
    """2 kg on an upright guide and a spring, 60 mm or so above its rest, without weight."""
    system = System(
        (Body("head", 2.0, (0.1, 0.1, 0.1), (0, 0, 1.0 + above)),),
        (Prismatic("guide", SPACE, "head", axis_i=(0, 0, 1), axis_j=(0, 0, 1),
                   normal_i=(1, 0, 0), normal_j=(1, 0, 0)),),
        (SpringDamper("strut", SPACE, "head", (0, 0, 0), (0, 0, 0), stiffness, 1.0, damping),),
    )  # fmt: skip
    return system, system.start()


@each_method
def test_oscillator_is_newmark_s_own(method: str) -> None:
    """The trapezoidal rule turns z by 2 atan(w h / 2) a step, and keeps the amplitude."""
    stiffness, dt, count = 500.0, 0.02, 200
    system, start = oscillator(stiffness, 0.0)
    stepper = Stepper(system, dt, method)
    stepper.begin(start, 0.0)
    for _ in range(count):
        stepper.step()
    turn = 2 * np.arctan(0.5 * np.sqrt(stiffness / 2.0) * dt)
    # 200 steps' round-off of a height of 1 m, and joints kept to 1e-12.
    expected = 1.0 + 0.06 * np.cos(count * turn)
    check("height [m]", stepper.motion.position[0, 2], expected, within=1e-9)


def test_stiff_spring_does_not_need_short_steps() -> None:
    """2 kg on 1e8 N/m: explicit steps would have to be below 0.3 ms; 5 ms keep the amplitude.

    What is predicted, w^2 h^2 / 2 = 600 times the amplitude, has to stay short of the spring's 1 m.
    """
    system, start = oscillator(1e8, 0.0, 1e-4)
    stepper = Stepper(system, 5e-3)
    stepper.begin(start, 0.0)
    heights = []
    for _ in range(400):
        stepper.step()
        heights.append(stepper.motion.position[0, 2])
    # Round-off of heights of 1 m, times w h = 35 a step.
    check("largest way from rest [m]", np.abs(np.array(heights) - 1.0).max(), 1e-4, within=1e-8)


def test_stop_returns_what_runs_into_it() -> None:
    """2 kg at 1 m/s into 2e5 N/m, w = 316 rad/s: half a period inside, then out at 1 m/s.

    The stop's force begins within a step, w h = 0.032: this much may be won or lost at each end.
    """
    system, start = oscillator(0.0, 0.0)
    system = system.with_forces(BumpStop("stop", SPACE, "head", longest=1.1, stiffness=2e5))
    dt, omega = 1e-4, np.sqrt(2e5 / 2.0)
    stepper = Stepper(system, dt)
    stepper.begin(start.with_velocities(np.array([0, 0, 1.0, 0, 0, 0])), 0.0)
    heights = []
    for _ in range(1000):
        stepper.step()
        heights.append(stepper.motion.position[0, 2])
    check("deepest [m]", max(heights) - 1.1, 1.0 / omega, within=omega * dt / omega)
    check("velocity [m/s]", stepper.motion.velocity[0, 2], -1.0, within=2 * omega * dt)
    inside = np.sum(np.array(heights) > 1.1) * dt
    check("time inside [s]", inside, np.pi / omega, within=2 * dt)


@each_method
@pytest.mark.parametrize("substeps", [1, 3])
def test_step_is_affine_in_its_force(method: str, substeps: int) -> None:
    """What is predicted for a force is what comes out, but for second orders: (h^2 f / m)^2."""
    length, dt, tip = 1.2, 1e-3, (0.6, 0.0, 0.0)
    system = pendulum(length)

    def up(motion: Motion) -> np.ndarray:
        return point(motion, "rod", tip).jacobian[2:].T

    def height(stepper: Stepper) -> float:
        return float(point(stepper.motion, "rod", tip).value[2])

    ends = {}
    for force in (0.0, 40.0, -80.0):
        stepper = Stepper(system, dt, method, up, substeps)
        stepper.begin(system.start(), 0.0, np.array([15.0]))
        for number in range(20):
            stepper.predict((number + 1) * dt)
            stepper.advance(np.array([15.0]))
        predicted = stepper.predict(21 * dt)
        displacement, velocity, _ = predicted.changes(np.array([force]))
        way = up(predicted.motion)[:, 0]
        at = point(predicted.motion, "rod", tip).value[2] + way @ displacement
        stepper.advance(np.array([force]))
        ends[force] = height(stepper), way @ stepper.motion.velocities
        # The force turns the rod by h^2 f L / (4 I) = 4e-5 at most; squares of it times L, and
        # of velocities, h f / m, with the turn.
        check("height [m]", ends[force][0], at, within=2e-9)
        speed = way @ (predicted.motion.velocities + velocity)
        check("its velocity [m/s]", ends[force][1], speed, within=1e-6)
    # Affine: three forces on a line.
    slope = (ends[40.0][0] - ends[0.0][0]) / 40.0
    check("on a line [m]", ends[-80.0][0], ends[0.0][0] - 80.0 * slope, within=4e-9)
    # The trapezoidal rule takes the mean of old and new force, also over substeps.
    by_force = 0.5 * dt * length**2 / (2.0 * length**2 / 3)
    # The rod turned away from the level by the 20 steps: 0.003 rad.
    found = (ends[40.0][1] - ends[0.0][1]) / 40.0
    check("velocity by force", found, by_force, within=by_force * 0.003**2 + 1e-8)


def test_substeps_are_shorter_steps() -> None:
    system = pendulum(1.2)
    one, other = Stepper(system, 4e-3, substeps=4), Stepper(system, 1e-3)
    for stepper in (one, other):
        stepper.begin(system.start(), 0.0)
    for _ in range(25):
        one.step()
        for _ in range(4):
            other.step()
    check("rod [m]", one.motion.position[0], other.motion.position[0], within=1e-13)


def test_feedback_keeps_less_than_removal_and_smaller_feedback_less() -> None:
    system = pendulum(1.2)
    opened = {}
    for name, solver in {
        "removed": Partitioned(),
        "penalised": Augmented(),
        "feedback 1": WithFeedback(1.0),
        "feedback 0.1": WithFeedback(0.1),
    }.items():
        stepper = Stepper(system, 2e-3, solver)
        stepper.begin(system.start(), 0.0)
        worst = 0.0
        for _ in range(500):
            stepper.step()
            worst = max(worst, stepper.violation())
        opened[name] = worst
        print(f"{name}: joints open by {worst:.1e} m")
    assert max(opened["removed"], opened["penalised"]) < 1e-11
    assert opened["removed"] < opened["feedback 1"] < opened["feedback 0.1"]


def test_mistakes_are_told() -> None:
    system = pendulum(1.2)
    stepper = Stepper(system, 1e-3)
    stepper.begin(system.start(), 0.0)
    with pytest.raises(RunBroken, match="before it was predicted"):
        stepper.advance()
    broken = PointForce("load", "rod", lambda time: (0.0, 0.0, np.nan if time else 0.0))
    stepper = Stepper(system.with_forces(broken), 1e-3)
    stepper.begin(system.start(), 0.0)
    with pytest.raises(RunBroken, match="not finite at 0.001 s"):
        stepper.step()
