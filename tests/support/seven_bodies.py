"""The paper's pantograph as tests use it: calibrated, at rest under the wire, under a load."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import paper_pantograph as ambrosio

from catenary.mbs.bodies import Motion
from catenary.mbs.forces import PointForce
from catenary.mbs.joints import PrescribedPoint, constant
from catenary.mbs.statics import calibrate_actuator, equilibrium
from catenary.mbs.system import System

ARM, HEAD = ambrosio.STABILISATION_ARM, ambrosio.HEAD
STATIC_FORCE = 150.0
HOLDER = PrescribedPoint("holder", ARM, constant(ambrosio.INITIAL_ARM_HEIGHT))
# [N] on the head by time [s], downward.
Load = Callable[[float], float]


def calibrated(static_force: float = STATIC_FORCE) -> System:
    """The corrected pantograph, its actuator for this static force at the paper's height."""
    system = ambrosio.pantograph()
    found = calibrate_actuator(system, ambrosio.ACTUATOR, HOLDER, system.start(), static_force)
    return system.with_force_changed(ambrosio.ACTUATOR, force=found.actuator_force)


def pressed(system: System, load: Load | float = STATIC_FORCE) -> System:
    """The same with a load on its head."""
    if callable(load):
        return system.with_forces(PointForce("wire", HEAD, lambda time: (0.0, 0.0, -load(time))))
    return system.with_forces(PointForce("wire", HEAD, (0.0, 0.0, -load)))


def at_rest(system: System) -> Motion:
    """True equilibrium of a pressed pantograph near the paper's height."""
    held = system.with_joints(HOLDER).assemble(system.start()).motion
    return equilibrium(system, held).motion


def lively_load(time: float) -> float:
    """150 N and components of 1, 2, ... 20 Hz that stay within +-30 N together.

    Sines of one size with phases that keep their sum low (Schroeder's, - pi k^2 / 20), from 150 N
    at time zero on: a load that jumped would excite what the comparison is not about.
    """
    return STATIC_FORCE + float(_SIZE * (np.sin(_OMEGA * time + _PHASES) - np.sin(_PHASES)).sum())


_NUMBERS = np.arange(1, 21)
_OMEGA = 2.0 * np.pi * _NUMBERS
_PHASES = -np.pi * _NUMBERS**2 / 20.0
_TIMES = np.linspace(0.0, 1.0, 4001)[:, None]
_SIZE = 30.0 / np.abs((np.sin(_OMEGA * _TIMES + _PHASES) - np.sin(_PHASES)).sum(axis=1)).max()
