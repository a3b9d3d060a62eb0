"""Multibody systems at rest: equilibrium, and what an actuator must push.

By virtual work: at rest N^T g = 0 with N the velocities that the joints allow (null space of
Phi_q), so that reactions need not be known.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from catenary.base.errors import InputError, RunBroken
from catenary.mbs.rigid.arrays import Joint
from catenary.mbs.rigid.bodies import Motion
from catenary.mbs.rigid.forces import Actuator
from catenary.mbs.rigid.least_squares import least_squares, null_space
from catenary.mbs.rigid.system import System

# Displacement of a degree of freedom for differences of forces [m or rad].
STEP = 1e-5
# Stiffnesses below this part of the largest one belong to motions that nothing resists.
NEUTRAL = 1e-9
# Largest displacement in one iteration [m or rad].
LONGEST = 0.1


class Rest(NamedTuple):
    """A system at rest: its place, the multipliers (m,) of its joints, and N^T g left over [N]."""

    motion: Motion
    multipliers: np.ndarray
    unbalanced: float


def equilibrium(
    system: System,
    start: Motion,
    time: float = 0.0,
    tolerance: float = 1e-9,
    max_iterations: int = 60,
) -> Rest:
    """The equilibrium near ``start``, stable or not, by Newton's method on the free motions.

    Motions that no force resists (a link turning about its own axis) stay where they are.

    Parameters
    ----------
    tolerance : largest force or moment left on a free motion, relative to the largest one applied

    Raises
    ------
    InputError
        The joints cannot be closed from there.
    RunBroken
        There is no equilibrium near by.
    """
    motion, left = at_rest(system, start, time, tolerance, max_iterations)
    return Rest(motion, _multipliers(system, motion, time), left)


def at_rest(
    system: System,
    start: Motion,
    time: float = 0.0,
    tolerance: float = 1e-9,
    max_iterations: int = 60,
) -> tuple[Motion, float]:
    """Place and N^T g of ``equilibrium``, without the multipliers."""
    resting = start.with_velocities(np.zeros(6 * start.n_bodies))
    motion = system.assemble(resting, time).motion
    size = float(np.abs(system.generalised_forces(motion, time)).max())
    left = np.inf
    for _ in range(max_iterations):
        free = null_space(system.constraints(motion, time).jacobian)
        unbalanced = free.T @ system.generalised_forces(motion, time)
        left = float(np.abs(unbalanced).max(initial=0.0))
        if left <= tolerance * size:
            return motion, left
        tangent = np.empty((free.shape[1],) * 2)
        for k in range(free.shape[1]):
            ahead, behind = (
                _unbalanced(system, motion, free, sign * STEP * free[:, k], time)
                for sign in (1.0, -1.0)
            )
            tangent[:, k] = (ahead - behind) / (2.0 * STEP)
        step = free @ least_squares(tangent, -unbalanced, NEUTRAL)
        longest = float(np.abs(step).max())
        if longest == 0.0:
            break  # nothing resists what is left over
        step *= min(1.0, LONGEST / longest)
        motion = system.assemble(motion.moved(step), time).motion
    raise RunBroken(
        f"The multibody system finds no equilibrium near its start: {left:.3g} N are left over; "
        "start closer to it, or check springs and actuators."
    )


def _unbalanced(
    system: System, motion: Motion, free: np.ndarray, displacement: np.ndarray, time: float
) -> np.ndarray:
    """Force on the free motions ``free`` (6 n, k) after a displacement, shape (k,)."""
    there = system.assemble(motion.moved(displacement), time).motion
    jacobian = system.constraints(there, time).jacobian
    # The same motions as the joints allow them there: a smooth basis, unlike a new null space.
    basis = free - least_squares(jacobian, jacobian @ free, 1e-8)
    return basis.T @ system.generalised_forces(there, time)


def _multipliers(system: System, motion: Motion, time: float) -> np.ndarray:
    """Multipliers that balance the forces, shape (m,), the smallest of redundant rows."""
    jacobian = system.constraints(motion, time).jacobian
    force = system.generalised_forces(motion, time)
    return least_squares(jacobian.T, force, 1e-8)


def unheld_force(system: System, motion: Motion, time: float = 0.0) -> float:
    """Size of the forces on all free motions together [N], zero where a system is at rest."""
    jacobian = system.constraints(motion, time).jacobian
    free = null_space(jacobian)
    return float(np.linalg.norm(free.T @ system.generalised_forces(motion, time)))


def held_force(system: System, holder: Joint, start: Motion, time: float = 0.0) -> float:
    """Force with which a system at rest presses on what holds it by one row [N].

    ``holder``, for instance a `PrescribedPoint`, is added to the joints; the force is positive
    in the direction in which the held coordinate grows.
    """
    return _pressed(system, holder, start, time)[0]


def _pressed(system: System, holder: Joint, start: Motion, time: float) -> tuple[float, Motion]:
    """The force of ``held_force``, and the place at rest."""
    rest = equilibrium(system.with_joints(holder), start, time)
    return float(rest.multipliers[-1]), rest.motion


class Calibration(NamedTuple):
    """``actuator_force`` [N], > 0 pushing its points apart; ``static_force`` [N] that it gives;
    ``gain``, static force per actuator force; ``force_before`` [N], the static force that the
    actuator gave with the force that stood in its data; ``motion`` at rest."""

    actuator_force: float
    static_force: float
    gain: float
    force_before: float
    motion: Motion


def calibrate_actuator(
    system: System,
    actuator: str,
    holder: Joint,
    start: Motion,
    static_force: float,
    near: Calibration | None = None,
) -> Calibration:
    """The constant actuator force with which the system presses with ``static_force`` on a holder.

    By virtual work at the place where the holder keeps the system. Held, an actuator may still
    move springs in series with it, so that the force is corrected until it is right to 1e-9.

    Parameters
    ----------
    near : what was found for another static force of the same system [N], to begin with

    Raises
    ------
    InputError
        The actuator does not act on what the holder holds.
    """
    before = system.force(actuator)
    if not isinstance(before, Actuator) or callable(before.force):
        raise InputError(f"Force {actuator!r} is no actuator with a constant force.")

    def pressed(push: float, start: Motion) -> tuple[float, Motion]:
        return _pressed(system.with_force_changed(actuator, force=push), holder, start, 0.0)

    if near is None:
        push = before.force
        had, start = pressed(push, start)
        unit_force = max(1.0, abs(push))
        gain = (pressed(push + unit_force, start)[0] - had) / unit_force
        if abs(gain) < 1e-9:
            raise InputError(
                f"Actuator {actuator!r} does not act on the {holder.name}: move its points off "
                "what it turns about, or to other bodies."
            )
        reached = had
    else:
        push, reached, gain, had, start = near
    for _ in range(20):
        push += (static_force - reached) / gain
        reached, start = pressed(push, start)
        if abs(reached - static_force) <= 1e-9 * max(1.0, abs(static_force)):
            return Calibration(push, reached, gain, had, start)
    raise RunBroken(
        f"Actuator {actuator!r} would need {push:.3g} N for a static force of {static_force:g} N, "
        "which is beyond calculation: check its points, springs and stops."
    )
