"""Frequency response, equivalent masses and stiffness of a pantograph at its head."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.signal import find_peaks

from catenary.base.errors import RunBroken
from catenary.mbs.lumped_data import LumpedData
from catenary.mbs.mechanism.multibody_pantograph import MultibodyData, reduced, stand
from catenary.mbs.response.linearisation import LinearModel, linearise, of_chain, with_strips
from catenary.mbs.rigid.bodies import Motion, Vector
from catenary.mbs.rigid.forces import PointForce
from catenary.mbs.rigid.joints import Constant, PrescribedPoint
from catenary.mbs.rigid.statics import equilibrium
from catenary.mbs.rigid.system import System

# Names of what is added to the mechanism here.
WIRE, HELD = "wire on the head", "arm held for a moment"


@dataclass(frozen=True)
class HeadResponse:
    """Small motions of a pantograph around rest under a wire that presses on its head.

    ``model``: linearised motions, loaded at the head, or at all its strips alike if they have
    springs of their own; ``static_force`` [N]; ``masses`` [kg] by
    name, equivalent ones of a mechanism; ``lift_stiffness`` [N/m]: by how much less the raising
    pushes a metre higher, negative if it pushes more.
    """

    model: LinearModel
    static_force: float
    masses: dict[str, float]
    lift_stiffness: float


class Peak(NamedTuple):
    """A frequency [Hz] at which the head answers most, with its receptance there [m/N]."""

    frequency: float
    receptance: complex


def head_response(data: LumpedData | MultibodyData, static_force: float) -> HeadResponse:
    """A pantograph without its laws linearised where it presses with ``static_force`` [N]. Not
    collective.

    Raises
    ------
    InputError
        A multibody pantograph cannot be assembled or raised.
    RunBroken
        It finds no rest under the wire.
    """
    if isinstance(data, MultibodyData):
        return _of_mechanism(data)
    masses = {f"mass {k + 1}": mass for k, mass in enumerate(data.masses)}
    model = with_strips(of_chain(data), data.strips)
    return HeadResponse(model, static_force, masses, data.stiffnesses[-1])


def _of_mechanism(data: MultibodyData) -> HeadResponse:
    standing = stand(data)
    system, rest, force = pressed_at_rest(data)
    (frame_mass, _, _), (_, lift_slope, _) = reduced(data).at(standing.working_height)
    masses = {
        f"head ({data.head})": standing.head.mass,
        f"frame at the arm ({data.arm})": float(frame_mass),
    }
    model = with_strips(linearise(system, rest, data.head), data.strips)
    return HeadResponse(model, force, masses, -float(lift_slope))


def pressed_at_rest(data: MultibodyData) -> tuple[System, Motion, float]:
    """The system with the wire's force on its head, its rest at the working height, the force [N].

    The force is the static one but for what head and arm being beside each other makes of it.
    """
    standing = stand(data)
    holder = PrescribedPoint(HELD, data.arm, Constant(standing.working_height))
    force, motion, left = standing.static_force, standing.motion, np.inf
    for _ in range(20):
        system = standing.system.with_forces(PointForce(WIRE, data.head, (0.0, 0.0, -force)))
        held = system.with_joints(holder)
        rest = equilibrium(held, motion, tolerance=1e-11)
        motion = rest.motion
        (left,) = rest.multipliers[held.row_ranges[HELD]]
        if abs(left) <= 1e-6:
            return system, motion, force
        force += float(left)
    raise RunBroken(
        f"Pantograph {data.name!r} finds no force on its head that holds its arm at the working "
        f"height: {left:.3g} N are left over."
    )


def peaks(model: LinearModel, frequencies: Vector) -> tuple[Peak, ...]:
    """Frequencies of the receptance's local maxima, to 1e-6 of each.

    ``frequencies`` (n,) [Hz], growing: each peak is searched for around one of them.
    """
    at = np.asarray(frequencies, dtype=float)

    def quietness(frequency: float) -> float:
        return -float(np.abs(model.receptance([frequency])[0]))

    found = []
    for k in find_peaks(np.abs(model.receptance(at)))[0]:
        best = minimize_scalar(
            quietness,
            bounds=(at[k - 1], at[k + 1]),
            method="bounded",
            options={"xatol": 1e-6 * at[k]},
        )
        found.append(Peak(float(best.x), complex(model.receptance([best.x])[0])))
    return tuple(found)
