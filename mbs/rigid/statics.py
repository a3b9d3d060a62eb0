"""Multibody systems at rest: equilibrium, and what an actuator must push.

By virtual work: at rest N^T g = 0 with N the velocities that the joints allow (null space of
Phi_q), so that reactions need not be known.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from catenary.base.errors import InputError, RunBroken
from catenary.mbs.rigid.bodies import Motion
from catenary.mbs.rigid.forces import Actuator
from catenary.mbs.rigid.joints import Joint
from catenary.mbs.rigid.system import System, least_squares, null_space

# Displacement of a degree of freedom for differences of forces [m or rad].
STEP = 1e-5
# Stiffnesses below this part of the largest one belong to motions that nothing resists.
NEUTRAL = 1e-9
# Largest displacement in one iteration [m or rad].
LONGEST = 0.1
_MOST_ITERATIONS = 60


class Rest(NamedTuple):
    """A system at rest: its place, and the multipliers (m,) of its joints."""

    motion: Motion
    multipliers: np.ndarray


def equilibrium(system: System, start: Motion, tolerance: float = 1e-9) -> Rest:
    """The equilibrium near ``start``, stable or not, by Newton's method on the free motions.

    Motions that no force resists (a link turning about its own axis) stay where they are.

    Parameters
    ----------
    system : System
        Bodies with their joints and forces.
    start : Motion
        Motion near the equilibrium.
    tolerance : float, optional
        Largest force or moment left on a free motion, relative to the largest one applied.

    Raises
    ------
    InputError
        The joints cannot be closed from there.
    RunBroken
        There is no equilibrium near by.
    """
    motion = at_rest(system, start, tolerance)
    # Of redundant rows the smallest multipliers.
    jacobian = system.constraints(motion, 0.0).jacobian
    force = system.generalised_forces(motion, 0.0)
    return Rest(motion, least_squares(jacobian.T, force, 1e-8))


def at_rest(system: System, start: Motion, tolerance: float = 1e-9) -> Motion:
    """The place of ``equilibrium``, without the multipliers; arguments and errors as there."""
    resting = start.with_velocities(np.zeros(6 * start.n_bodies))
    motion = system.assemble(resting)
    force = system.generalised_forces(motion, 0.0)
    size = float(np.abs(force).max())
    left = np.inf
    for _ in range(_MOST_ITERATIONS):
        free = null_space(system.constraints(motion, 0.0).jacobian)
        unbalanced = free.T @ force
        left = float(np.abs(unbalanced).max(initial=0.0))
        if left <= tolerance * size:
            return motion
        tangent = np.empty((free.shape[1],) * 2)
        for k in range(free.shape[1]):
            ahead, behind = (
                force_on_ways(system, motion.moved(sign * STEP * free[:, k]), free)
                for sign in (1.0, -1.0)
            )
            tangent[:, k] = (ahead - behind) / (2.0 * STEP)
        step = free @ least_squares(tangent, -unbalanced, NEUTRAL)
        longest = float(np.abs(step).max())
        if longest == 0.0:
            break  # nothing resists what is left over
        step *= min(1.0, LONGEST / longest)
        motion = system.assemble(motion.moved(step))
        force = system.generalised_forces(motion, 0.0)
    raise RunBroken(
        f"The multibody system finds no equilibrium near its start: {left:.3g} N are left over; "
        "start closer to it, or check springs and actuators."
    )


def force_on_ways(system: System, motion: Motion, ways: np.ndarray) -> np.ndarray:
    """Force on motions ``ways`` (6 n, k), as the joints allow them at a place near by, (k,)."""
    there = system.assemble(motion)
    jacobian = system.constraints(there, 0.0).jacobian
    # The least change that makes them allowed: smooth, unlike another null space.
    basis = ways
    if len(jacobian):
        basis = ways - least_squares(jacobian, jacobian @ ways, 1e-8)
    return basis.T @ system.generalised_forces(there, 0.0)


def unheld_force(system: System, motion: Motion) -> float:
    """Size of the forces on all free motions together [N], zero where a system is at rest."""
    free = null_space(system.constraints(motion, 0.0).jacobian)
    return float(np.linalg.norm(free.T @ system.generalised_forces(motion, 0.0)))


def held_force(system: System, holder: Joint, start: Motion) -> float:
    """Force with which a system at rest near ``start`` presses on a joint that holds it by one row
    [N].

    ``holder``, for instance a `PrescribedPoint`, is added to the joints; the force is positive in
    the direction in which the held coordinate grows.
    """
    return float(equilibrium(system.with_joints(holder), start).multipliers[-1])


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
    held: System,
    actuator: str,
    start: Motion,
    static_force: float,
    near: Calibration | None = None,
) -> Calibration:
    """The constant actuator force with which the system presses with ``static_force`` on a holder.

    By virtual work at the place where the holder keeps the system. Held, an actuator may still
    move springs in series with it, so that the force is corrected until it is right to 1e-9.

    Parameters
    ----------
    held : System
        Bodies with their forces and joints, the last of which, of one row, holds them.
    actuator : str
        Name of the actuator.
    start : Motion
        Motion near the equilibrium.
    static_force : float
        Force on the holder to be reached [N].
    near : Calibration, optional
        Calibration of the same system for another static force, to begin with.

    Raises
    ------
    InputError
        The actuator does not act on what the holder holds.
    """
    before = held.force(actuator)
    if not isinstance(before, Actuator):
        raise InputError(f"Force {actuator!r} is no actuator.")

    def pressed(push: float, start: Motion) -> tuple[float, Motion]:
        rest = equilibrium(held.with_force_changed(actuator, force=push), start)
        return float(rest.multipliers[-1]), rest.motion

    if near is None:
        push = before.force
        had, start = pressed(push, start)
        unit_force = max(1.0, abs(push))
        gain = (pressed(push + unit_force, start)[0] - had) / unit_force
        if abs(gain) < 1e-9:
            raise InputError(
                f"Actuator {actuator!r} does not act on the {held.joints[-1].name}: move its "
                "points off what it turns about, or to other bodies."
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
