"""The paper's pantograph as tests use it: calibrated, at rest under the wire, under a load."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import paper_pantograph as ambrosio

from catenary.mbs.rigid.bodies import SPACE, Motion
from catenary.mbs.rigid.forces import PointForce
from catenary.mbs.rigid.joints import Constant, PrescribedAngle, PrescribedPoint
from catenary.mbs.rigid.statics import calibrate_actuator, equilibrium
from catenary.mbs.rigid.system import System

ARM, HEAD = ambrosio.STABILISATION_ARM, ambrosio.HEAD
STATIC_FORCE = 150.0
assert ambrosio.INITIAL_ARM_HEIGHT is not None
HOLDER = PrescribedPoint("holder", ARM, Constant(ambrosio.INITIAL_ARM_HEIGHT))
# The lower link is top-heavy between its two balls: its mass lies above the line through them, by
# Table 4's -0.025 m, and it tips over with 2.7 1/s. What starts with round-off of 1e-12 m has
# tipped over after some 12 s. This holds it upright where that is not what is looked at.
UPRIGHT = PrescribedAngle(
    "lower link upright",
    SPACE,
    ambrosio.LOWER_LINK,
    0.0,
    axis_i=(1.0, 0.0, 0.0),
    normal_i=(0.0, 0.0, 1.0),
    normal_j=(0.0, 0.0, 1.0),
)
# [N] on the head by time [s], downward.
Load = Callable[[float], float]


def calibrated(static_force: float = STATIC_FORCE) -> System:
    """The corrected pantograph, its actuator for this static force at the paper's height."""
    system = ambrosio.pantograph()
    found = calibrate_actuator(
        system.with_joints(HOLDER), ambrosio.ACTUATOR, system.start(), static_force
    )
    return system.with_force_changed(ambrosio.ACTUATOR, force=found.actuator_force)


def pressed(system: System, load: Load | float = STATIC_FORCE) -> System:
    """The same with a load on its head."""
    if callable(load):
        return system.with_forces(PointForce("wire", HEAD, lambda time: (0.0, 0.0, -load(time))))
    return system.with_forces(PointForce("wire", HEAD, (0.0, 0.0, -load)))


def at_rest(system: System) -> Motion:
    """True equilibrium of a pressed pantograph near the paper's height."""
    held = system.with_joints(HOLDER).assemble(system.start())
    return equilibrium(system, held).motion


def lively_load(time: float) -> float:
    """150 N and sines of 1, 2, ... 20 Hz of one size that stay within +-30 N together.

    Sines only: the load starts at 150 N, at which the pantograph is at rest. Their signs change
    like those of a quadratic phase, so that not all of them are large at once.
    """
    return STATIC_FORCE + float(_SIZES @ np.sin(_OMEGA * time))


_NUMBERS = np.arange(1, 21)
_OMEGA = 2.0 * np.pi * _NUMBERS
_SIGNS = (-1.0) ** (_NUMBERS * (_NUMBERS - 1) // 2)
_TIMES = np.linspace(0.0, 1.0, 4001)[:, None]
_SIZES = 30.0 / np.abs(np.sin(_OMEGA * _TIMES) @ _SIGNS).max() * _SIGNS
