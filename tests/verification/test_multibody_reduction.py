"""Mechanisms reduced to one height: a lever in closed form, the paper's frame with all bodies."""

from __future__ import annotations

import numpy as np
import paper_pantograph as ambrosio
import pytest
from body_mechanics import acceleration, equivalent_mass
from constraint_handling import Baumgarte
from measuring import check
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline
from variable_steps import integrate

from catenary import InputError
from catenary.mbs.mechanism.reduction import FINEST, reduce_mechanism
from catenary.mbs.rigid.bodies import SPACE, Body, point
from catenary.mbs.rigid.forces import BumpStop, Gravity, SpringDamper
from catenary.mbs.rigid.joints import Constant, PrescribedPoint, Revolute
from catenary.mbs.rigid.system import System

ARM = ambrosio.STABILISATION_ARM
G = 9.81


def test_lever_in_closed_form() -> None:
    """A rod at the angle a, its end at h = L sin a: m = m_rod / (3 cos^2 a), lift - m_rod g / 2.

    A damper c upright from a point far below its end damps with c.
    """
    length, mass, damping = 2.0, 3.0, 40.0
    moment = mass * length**2 / 12
    end, far = (length / 2, 0, 0), 1e6
    system = System(
        (Body("rod", mass, (1e-3 * moment, moment, moment), (length / 2, 0, 0)),),
        (Revolute("hinge", SPACE, "rod", at_j=(-length / 2, 0, 0)),),
        (
            Gravity((mass,), G),
            SpringDamper("damper", SPACE, "rod", (length, 0, -far), end, damping=damping),
        ),
    )
    heights = np.linspace(-0.5, 1.0, 16)
    found = reduce_mechanism(system, "rod", heights, end)
    cosine_squared = 1 - (heights / length) ** 2
    check("mass [kg]", found.masses, mass / (3 * cosine_squared), within=1e-9)
    check("lift [N]", found.lifts, -mass * G / 2, within=1e-9)
    # The damper leans by (L - L cos a) / far, at most 3e-7.
    check("damping [N s/m]", found.dampings, damping, within=damping * 1e-6)
    riding = reduce_mechanism(system, "rod", heights, end, riding=(8.0, end))
    beside = 8.0 * (1 / cosine_squared - 1)  # it moves along the track by tan a of the height
    check("mass with one that rides [kg]", riding.masses, found.masses + beside, within=1e-9)
    speed, push, at = 0.7, 25.0, 0.5
    slope = 2 * at / length**2 * mass / 3 / (1 - (at / length) ** 2) ** 2
    force = push - mass * G / 2 - damping * speed - slope * speed**2 / 2
    expected = force / (mass / 3 / (1 - (at / length) ** 2))
    # Cubic splines over 0.1 m: 0.1^3 of the fourth derivative of 1 / (1 - h^2 / 4), below 5, / 24.
    within = 5 * 0.1**3 / 24 * speed**2 + 1e-4
    check("acceleration [m/s^2]", acceleration(found, at, speed, push), expected, within=within)


@pytest.mark.parametrize("engages", [0.413, 0.5, 0.52, 0.987])
def test_heights_are_put_in_where_a_stop_engages(engages: float) -> None:
    """A rod that rests on a hinge, with a stop above its end: lift - m g / 2 - k (h - h_0).

    Heights are 0.02 m apart. The kink is within an interval, on a height, or near the end.
    """
    length, mass, stiffness, far, tolerance = 2.0, 3.0, 1e5, 1e6, 0.2
    moment = mass * length**2 / 12
    end = (length / 2, 0, 0)
    system = System(
        (Body("rod", mass, (1e-3 * moment, moment, moment), (length / 2, 0, 0)),),
        (Revolute("hinge", SPACE, "rod", at_j=(-length / 2, 0, 0)),),
        (
            Gravity((mass,), G),
            BumpStop(
                "stop", SPACE, "rod", (length, 0, far), end, far - engages, stiffness=stiffness
            ),
        ),
    )
    heights = np.arange(0.0, 1.001, 0.02)
    dense = np.linspace(0.0, 1.0, 4001)
    expected = -mass * G / 2 - stiffness * np.maximum(dense - engages, 0.0)
    refined = reduce_mechanism(system, "rod", heights, end, tolerance=tolerance)
    as_given = reduce_mechanism(system, "rod", heights, end)
    assert as_given.heights.size == heights.size < refined.heights.size
    missed = np.abs(CubicSpline(refined.heights, refined.lifts)(dense) - expected)
    # Where no closer heights are put in, a spline rounds a kink off by k spacing / 8 at most, over
    # two intervals; elsewhere it keeps to the tolerance.
    kink = np.abs(dense - engages) < 4 * FINEST
    check("lift away from the stop [N]", missed[~kink].max(), 0.0, within=2 * tolerance)
    check("lift where it engages [N]", missed.max(), 0.0, within=stiffness * 2 * FINEST / 8)
    coarse = np.abs(CubicSpline(as_given.heights, as_given.lifts)(dense) - expected)
    assert coarse[~kink].max() > 20 * tolerance


def test_frame_of_the_paper_rises_like_all_its_bodies() -> None:
    """0.3 s from rest at 1.35 m with the actuator at full force: the same to the tables' error.

    Heights every 25 mm; refined to 12.5 mm the tables change the rise by what is allowed here.
    """
    frame = ambrosio.frame()
    holder = PrescribedPoint("holder", ARM, Constant(1.35))
    start = frame.with_joints(holder).assemble(frame.start())
    times = np.array([0.0, 0.1, 0.2, 0.3])
    way = integrate(frame, Baumgarte(), start, times, rtol=1e-9)
    full = np.array([point(motion, ARM, (0, 0, 0)).value[2] for motion in way.motions])
    rises = []
    for n in (21, 41):
        reduced = reduce_mechanism(frame, ARM, np.linspace(1.3, 1.8, n))
        rises.append(
            solve_ivp(
                lambda t, y, r=reduced: (y[1], acceleration(r, y[0], y[1])),
                (0.0, times[-1]),
                (1.35, 0.0),
                "DOP853",
                t_eval=times,
                rtol=1e-10,
                atol=1e-12,
            ).y[0]
        )
    print(f"rises by {full[-1] - full[0]:.4f} m")
    assert full[-1] - full[0] > 0.2
    refined = np.abs(rises[1] - rises[0]).max()
    check("arm [m]", rises[1], full, within=max(refined, 1e-8))


def test_mass_of_the_frame_is_its_equivalent_mass_and_heights_must_be_reached() -> None:
    frame = ambrosio.frame()
    heights = [1.3, 1.4, ambrosio.INITIAL_ARM_HEIGHT, 1.5]
    reduced = reduce_mechanism(frame, ARM, heights)
    for height, mass in zip(heights, reduced.masses, strict=True):
        holder = PrescribedPoint("holder", ARM, Constant(height))
        motion = frame.with_joints(holder).assemble(frame.start())
        expected = equivalent_mass(frame, motion, ARM)
        check(f"mass at {height} m [kg]", mass, expected, within=1e-8 * expected)
    print(f"lift {reduced.lifts} N, damping {reduced.dampings} N s/m")
    with pytest.raises(InputError, match="joints cannot be closed"):
        reduce_mechanism(frame, ARM, [1.4, 1.5, 1.6, 9.0])
    with pytest.raises(InputError, match="at least four growing heights"):
        reduce_mechanism(frame, ARM, [1.4, 1.5])
