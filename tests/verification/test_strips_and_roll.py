"""Heads with two strips, heads that roll: against chains of masses, statics and SciPy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import paper_pantograph as paper
import pytest
from measuring import History, check, orders, print_table, start_march
from scipy.integrate import solve_ivp
from small_lines import WHOLE, en50318_line, mesh_of, numerics, problem_of, train

from catenary.mbs.build import raising_data
from catenary.mbs.head.stepping import LateralPath, Stepping
from catenary.mbs.head.strips import Strips, Suspension, Turning
from catenary.mbs.lumped import LumpedData, LumpedPantograph
from catenary.mbs.mechanism.full_pantograph import FullPantograph
from catenary.mbs.mechanism.multibody_pantograph import stand
from catenary.mbs.mechanism.reduction import RaisingPantograph
from catenary.mbs.rigid.forces import PointForce
from catenary.mbs.rigid.joints import Constant, PrescribedPoint
from catenary.mbs.rigid.statics import equilibrium
from catenary.solver.problem.contact_laws import ContactLaw, KinematicLaw, LinearLaw

EPS = np.finfo(float).eps
TWO = LumpedData((7.2, 15.0), (4200.0, 50.0), (10.0, 90.0))
ROLL = Turning(2.0, 470.0, 60.0)
# What is left after 100 s of 120 N / 4200 N/m, at which 500 N s/m on 50 N/m start [m].
LEFT = 0.03 * np.exp(-10.0)


def straight(place: float, offsets: tuple[float, ...] = (0.0,)) -> LateralPath:
    """A wire that stays at one lateral position [m]."""
    return LateralPath([(np.array([0.0, 1e4]), (place, place))], 100.0, offsets, 70.0)


def test_two_equal_strips_on_springs_are_one_more_mass_of_a_chain() -> None:
    """Both pressed alike: one strip of twice the mass on twice the spring. Round-off only."""
    own = Suspension(0.9, 5000.0, 15.0)
    strips = LumpedPantograph(
        replace(TWO, strips=Strips(2, 0.5, None, own, Turning(0.3, 200.0, 1.0))),
        120.0, 5.5, Stepping(0.1, 1e-3),
    )  # fmt: skip
    chain = LumpedData((1.8, 5.4, 15.0), (10000.0, 4200.0, 50.0), (30.0, 10.0, 90.0))
    expected = LumpedPantograph(chain, 120.0, 5.5, Stepping(0.1, 1e-3))
    for pantograph in (strips, expected):
        pantograph.place(5.45)
    for number in range(500):
        force = 100.0 + 50.0 * np.sin(0.05 * number)
        for pantograph, forces in ((strips, [force / 2] * 2), (expected, [force])):
            pantograph.predict(1e-3 * (number + 1))
            pantograph.advance(np.array(forces))
    # Accelerations from springs of 1e4 N/m over heights of 5 m and masses of 0.9 kg.
    within = 500 * EPS * 1e4 * 5.5 / 0.9 * 1e-3
    check("strips [m]", strips.position[:2], [expected.position[0]] * 2, within=within)
    check("head and frame [m]", strips.position[[2, 4]], expected.position[1:], within=within)
    check("pitch [rad]", strips.position[3], 0.0, within=within)
    # A velocity's round-off is that of a height by the step of 1 ms.
    check("strips [m/s]", strips.velocity[:2], [expected.velocity[0]] * 2, within=1e3 * within)
    check("others [m/s]", strips.velocity[[2, 4]], expected.velocity[1:], within=1e3 * within)


def test_uneven_forces_on_two_strips_pitch_the_head_as_statics_say() -> None:
    """Fixed strips of a head at rest: theta = (f1 - f2) spacing / 2 / k."""
    pitch = Turning(0.3, 200.0, 20.0)
    spacing, front, rear = 0.5, 70.0, 50.0
    data = replace(TWO, dampings=(400.0, 500.0), strips=Strips(2, spacing, None, None, pitch))
    pantograph = LumpedPantograph(data, 120.0, 5.5, Stepping(0.0, 5e-3))
    pantograph.place(5.5)
    for number in range(20000):
        head = pantograph.predict(5e-3 * (number + 1))
        pantograph.advance(np.array([front, rear]))
    angle = -(front - rear) * spacing / 2 / 200.0
    heights = head.height - head.height_compliance @ [front, rear]
    check("pitch [rad]", pantograph.position[1], angle, within=1e-9)
    check("front strip [m]", heights[0], 5.5 + angle * spacing / 2, within=LEFT)
    check("rear strip [m]", heights[1], 5.5 - angle * spacing / 2, within=LEFT)


def test_a_force_beside_the_middle_rolls_the_head_as_statics_say() -> None:
    """phi = - l f / k_roll, and the strip gives way by l phi more than the head."""
    place, force = 0.3, 120.0
    data = replace(TWO, dampings=(400.0, 500.0), roll=ROLL)
    pantograph = LumpedPantograph(data, force, 5.5, Stepping(0.0, 5e-3, lateral=straight(place)))
    pantograph.place(5.5)
    for number in range(20000):
        head = pantograph.predict(5e-3 * (number + 1))
        pantograph.advance(np.array([force]))
    angle = -place * force / ROLL.stiffness
    check("roll [rad]", pantograph.position[1], angle, within=1e-9)
    height = (head.height - head.height_compliance @ [force]).item()
    check("strip [m]", height, 5.5 + place * angle, within=LEFT)
    check("head [m]", pantograph.position[0], 5.5, within=LEFT)


def test_a_rolling_head_under_a_wire_that_wanders_follows_its_equations() -> None:
    """Against SciPy; order 2 in dt. The strip's velocity is the rate of its height."""
    speed, end = 80.0, 0.3
    supports, stagger = np.array([0.0, 110.0, 160.0]), (-0.25, -0.2, 0.25)
    force = lambda t: 120.0 + 60.0 * np.sin(30.0 * t)  # noqa: E731
    # One wire from mast to mast at 110 m: the kink in the stagger is passed at a step of all dt.
    start = 110.0 - 0.1 * speed

    def lateral(t: float) -> float:
        return float(np.interp(start + speed * t, supports, stagger))

    k, kb, c, cb = 4200.0, 50.0, 10.0, 90.0
    base = 5.5 + 120.0 / k

    def rates(t: float, q: np.ndarray) -> np.ndarray:
        y, phi, z, vy, vphi, vz = q
        spring, f, arm = k * (z - y) + c * (vz - vy), force(t), lateral(t)
        roll = -ROLL.stiffness * phi - ROLL.damping * vphi - arm * f
        lift = 120.0 + kb * (base - z) - cb * vz
        return np.array([vy, vphi, vz, (spring - f) / 7.2, roll / 2.0, (lift - spring) / 15.0])

    exact = np.array([5.5, 0.0, 5.5, 0.0, 0.0, 0.0])
    for begin, stop in ((0.0, 0.1), (0.1, end)):
        piece = solve_ivp(rates, (begin, stop), exact, rtol=1e-11, atol=1e-13, max_step=1e-3)
        exact = piece.y[:, -1]
    steps, errors, rolls = [4e-3, 2e-3, 1e-3, 0.5e-3], [], []
    for dt in steps:
        path = LateralPath([(supports, stagger)], start, (0.0,), speed)
        pantograph = LumpedPantograph(
            replace(TWO, roll=ROLL), 120.0, 5.5, Stepping(0.0, dt, lateral=path)
        )
        pantograph.place(5.5)
        # The start without contact leaves the acceleration that the force at time 0 makes.
        state = pantograph.state()
        state[6:8] -= [force(0.0) / 7.2, lateral(0.0) * force(0.0) / 2.0]
        pantograph.restore(state)
        for number in range(round(end / dt)):
            time = dt * (number + 1)
            head = pantograph.predict(time)
            pantograph.advance(np.array([force(time)]))
        found = (head.velocity - head.velocity_compliance @ [force(end)]).item()
        touching = exact[3] + lateral(end) * exact[4] + speed * 0.45 / 50.0 * exact[1]
        errors.append(abs(found - touching))
        rolls.append(abs(pantograph.position[1] - exact[1]))
    observed = print_table("velocity of the strip [m/s]", steps, errors)
    assert exact[1] ** 2 > 1e-5
    # Finite dt: the next order is a part in ten of the first at 1 ms.
    check("order of the velocity", observed[-1], 2.0, within=0.2)
    check("order of the roll", orders(rolls)[-1], 2.0, within=0.2)


def test_the_paper_s_head_rolls_as_its_bodies_at_rest() -> None:
    """All seven bodies with the arm held, the force beside the middle.

    What the roll leaves out are moments of weight and force on a head that leans: 150 N and the
    head's 76 N at most 0.1 m above the hinge, beside 673 N m/rad.
    """
    data, force, place = paper.data(), 150.0, 0.2
    standing = stand(data)
    holder = PrescribedPoint("holder", data.arm, Constant(standing.working_height))
    pushed = PointForce("wire", data.head, (0.0, 0.0, -force), (0.0, place, 0.0))
    system = standing.system.with_forces(pushed).with_joints(holder)
    motion = equilibrium(system, standing.motion).motion
    angle = float(np.arcsin(motion.rotation[motion.numbers[data.head]][2, 1]))
    roll = data.roll
    assert roll is not None
    # Table 4: two springs of 3000 N/m at 0.335 m; Table 2: 6.62 kg m2, 7.8 kg 0.07 m above joint 8.
    check("stiffness [N m/rad]", roll.stiffness, 6000.0 * 0.335**2, within=0.1)
    check("damping [N m s/rad]", roll.damping, 26.0 * 0.335**2, within=1e-3)
    check("inertia [kg m2]", roll.inertia, 6.62 + 7.8 * 0.07**2, within=7.8 * 0.01 * 0.16)
    expected = -place * force / roll.stiffness
    leaning = (force + 7.8 * 9.81) * 0.1 / roll.stiffness
    check("roll [rad]", angle, expected, within=leaning * abs(expected))


def test_the_paper_s_head_rolls_under_a_wandering_wire_like_all_its_bodies() -> None:
    """Against all bodies stepped together, under the same force on the same way along the strip.

    Apart by the moments of the test above, of what the roll moves the strip by, and by the 0.1 kg
    of 33.5 kg that the head carries along the track, of the whole motion.
    """
    data, force, dt = paper.data(), 150.0, 1e-3
    path = LateralPath(
        [(np.array([0.0, 50.0, 100.0, 150.0]), (0.2, -0.2, 0.2, -0.2))], 10.0, (0.0,), 80.0
    )
    rolling = raising_data(data, force, 5.0)
    pantographs = (
        FullPantograph(data, force, 5.0, Stepping(0.0, dt, lateral=path)),
        RaisingPantograph(rolling, Stepping(0.0, dt, lateral=path)),
        RaisingPantograph(rolling, Stepping(0.0, dt)),
    )
    for pantograph in pantographs:
        pantograph.place(5.0)
    heights = np.empty((600, 3))
    for number in range(600):
        time = dt * (number + 1)
        pressed = np.array([force + 30.0 * np.sin(6 * np.pi * time)])
        for i, pantograph in enumerate(pantographs):
            head = pantograph.predict(time)
            heights[number, i] = (head.height - head.height_compliance @ pressed).item()
            pantograph.advance(pressed)
    moved = np.ptp(heights[:, 0])
    by_roll = np.abs(heights[:, 1] - heights[:, 2]).max()
    leaning = (force + 7.8 * 9.81) * 0.1 / (6000.0 * 0.335**2)
    within = by_roll * leaning + moved * 0.1 / 33.5
    check("strip [m]", heights[:, 1], heights[:, 0], within=within)
    assert by_roll > 10 * within


def run_on_a_line(
    strips: Strips, law: ContactLaw, roll: Turning | None = None, elements: int = 4
) -> History:
    line = replace(en50318_line(3), stagger=(0.2, -0.2, 0.2, -0.2))
    data = replace(TWO, strips=strips, roll=roll)
    effects = WHOLE | {"head_roll"} if roll is not None else WHOLE
    ours = train(70.0, 30.0, 120.0, data=data)
    # What a moving kinematic contact needs: average acceleration remembers its jumps.
    damped = {"beta": 0.28, "gamma": 0.55} if isinstance(law, KinematicLaw) else {}
    stepping = numerics(2e-3, **damped)
    problem = problem_of(line, effects, contact=law, train=ours, numerics=stepping)
    march, _ = start_march(problem, mesh_of(line, elements))
    history = History(watch=lambda view: view.strip_force.copy())
    history.outcome = march.run([history])
    march.destroy()
    assert history.outcome.outcome == "done"
    return history


def test_two_strips_beside_each_other_press_like_one_of_twice_the_stiffness() -> None:
    """Fixed to one head a hair apart: half the force each, by the inner problem's one solution.

    Slopes of 0.01 over 1e-7 m and 50 kN/m are 5e-5 N between them, and their sum does not notice.
    """
    pair = run_on_a_line(Strips(2, 1e-7), LinearLaw(5e4, 0.0))
    one = run_on_a_line(Strips(), LinearLaw(1e5, 0.0))
    check("sum [N]", pair["contact_force"], one["contact_force"], within=1e-4)
    strips = np.array(pair.watched)
    check("strips [N]", strips[:, 0], strips[:, 1], within=1e-4)
    check("sum of strips [N]", strips.sum(axis=1), pair["contact_force"][:, 0], within=1e-10)
    assert one["contact_force"].std() > 10.0


def test_two_strips_without_depth_share_the_force() -> None:
    """Kinematic contact of a head that pitches: the wire's own compliance decides who carries what.

    The sum swings about the static force; neither strip carries all of it. Elements are shorter
    than the strips are apart.
    """
    strips = Strips(2, 0.56, pitch=Turning(0.3, 200.0, 5.0))
    found = run_on_a_line(strips, KinematicLaw(), elements=12)
    strips = np.array(found.watched)[300:]
    check("mean sum [N]", strips.sum(axis=1).mean(), 120.0, within=20.0)
    assert (strips.mean(axis=0) > 30.0).all()


def test_fixed_strips_that_cannot_follow_the_wire_s_slope_end_the_run() -> None:
    """Two places of a sloping wire cannot both lie on a level head without a pull."""
    with pytest.raises(AssertionError, match="would have to pull"):
        run_on_a_line(Strips(2, 0.56), KinematicLaw(), elements=12)


@pytest.mark.parametrize("number", [1, 2])
def test_a_head_too_heavy_to_roll_presses_like_one_that_does_not(number: int) -> None:
    """1e9 kg m2 roll by less than l f t^2 / 2 / 1e9 = 4e-8 rad in 1.3 s, 8e-9 m of 50 kN/m."""
    strips = Strips(number, 0.5 * (number - 1))
    stiff = run_on_a_line(strips, LinearLaw(5e4, 0.0), Turning(1e9, 0.0, 0.0))
    plain = run_on_a_line(strips, LinearLaw(5e4, 0.0))
    check("force [N]", stiff["contact_force"], plain["contact_force"], within=1e-3)
    real = run_on_a_line(strips, LinearLaw(5e4, 0.0), ROLL)
    assert np.abs(real["contact_force"] - plain["contact_force"]).max() > 1.0
