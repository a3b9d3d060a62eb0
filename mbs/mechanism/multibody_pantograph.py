"""A pantograph as a multibody system: its data, and what a running one is made from.

The head stands on springs on one body, the arm, and everything else is a mechanism that raises
the arm. Head and mechanism are taken apart: the head becomes a mass on a spring and a damper, the
mechanism tables over the arm's height. Both follow from the bodies, joints and forces themselves.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from catenary.base.errors import InputError, RunBroken
from catenary.mbs.air import Uplift
from catenary.mbs.head.laws import Law
from catenary.mbs.head.strips import ONE_STRIP, Strips, Turning
from catenary.mbs.mechanism.reduction import Head, Raised, ReducedMechanism, reduce_mechanism
from catenary.mbs.rigid.bodies import Motion
from catenary.mbs.rigid.forces import Force, Gravity, PointForce, SpringDamper, gradient_of
from catenary.mbs.rigid.joints import Constant, Joint, PrescribedPoint
from catenary.mbs.rigid.statics import (
    Calibration,
    calibrate_actuator,
    equilibrium,
    unheld_force,
)
from catenary.mbs.rigid.system import Miss, System, bodies_on, least_squares

logger = logging.getLogger("catenary.multibody")

# Heights over which a mechanism is reduced, to either side of its working height, and how far
# they are apart [m]: transition spans rise by half a metre.
REACH, SPACING = 0.6, 0.02
# Between those heights, to how much the lift is right [N].
LIFT_TOLERANCE = 0.2
# Part of the head's travel over which its spring is measured [m].
TRAVEL = 0.01
# Forces on further motions of the mechanism that show that it has no hold, over its weight. A link
# that may spin between two balls, a little off its balance, stays well below.
ADRIFT = 0.01
# More than any actuator's force [N].
MOST_FORCE = 1e7
# The joint that holds the arm in what is computed here.
HOLDER = "height of the arm"
# Travel over which slopes of springs are measured [m].
_TRAVEL = 1e-3
# Part of a unit turn that joints may miss where they allow it.
_MISSED = 1e-6
# About the track and across it.
ROLL, PITCH = 0, 1


@dataclass(frozen=True)
class AllBodies:
    """Integration of all bodies in the time loop: joints kept by ``handling``, one of
    `implicit_steps.METHODS`, in so many ``substeps`` of the line's step."""

    handling: str = "coordinate_partitioning"
    substeps: int = 1


@dataclass(frozen=True)
class MultibodyData:
    """A pantograph as a multibody system; heights from the base, x along the track, z up.

    ``name`` for messages; ``system`` with joints that ``assembly_tolerance`` [m] lets miss in the
    given positions; ``head``, ``arm`` names of bodies; ``working_height`` [m] of the arm's centre
    of mass, None for where the joints close; ``actuator`` is the force to be calibrated to
    ``static_force`` [N], both None if forces hold as they are; ``wind`` are forces of the air at
    the train's speed and ``uplift`` lifts head and arm, both not at standstill, where the static
    force is measured; ``strips`` are parts of the head.
    ``all_bodies`` has all bodies in the time loop; with None the mechanism is reduced to tables.
    ``laws`` that are not linear act on head (0) and arm (1) besides. ``crosswind_factor`` is what
    a cross wind counts in the air's speed (`wind.airflow`).
    """

    name: str
    system: System
    head: str
    arm: str
    working_height: float | None = None
    actuator: str | None = None
    static_force: float | None = None
    assembly_tolerance: float = 0.05
    wind: tuple[PointForce, ...] = ()
    strips: Strips = ONE_STRIP
    all_bodies: AllBodies | None = None
    uplift: Uplift | None = None
    laws: tuple[Law, ...] = ()
    crosswind_factor: float = 0.0

    @property
    def meets_air(self) -> bool:
        """Whether the air has forces on it."""
        return self.uplift is not None or bool(self.wind)

    @property
    def roll(self) -> Turning | None:
        """Roll of the head about the track as its joints allow it, None if they do not."""
        return stand(self).head.roll


class Standing(NamedTuple):
    """A pantograph at its working height, pressing with its static force.

    ``system`` with the calibrated actuator; ``motion`` without contact; ``missed`` is by how much
    joints missed in the given positions; ``actuator_force`` [N], None if nothing was calibrated,
    and ``force_before`` [N], the static force that the data's own actuator force gives.
    ``n_freedoms`` counts the degrees of freedom, one of which is the raising.
    """

    system: System
    motion: Motion
    missed: tuple[Miss, ...]
    working_height: float
    static_force: float
    actuator_force: float | None
    force_before: float
    n_freedoms: int
    head: Head


@lru_cache(maxsize=64)
def stand(data: MultibodyData) -> Standing:
    """The pantograph at its working height: assembled, judged and calibrated. Not collective.

    Raises
    ------
    InputError
        In one sentence: it cannot be assembled, or is no mechanism that raises a head on springs.
    """
    mechanism = _mechanism(_bodies_of(data))
    height, system, held = mechanism.height, mechanism.system, mechanism.held
    holder = held.joints[-1]
    push = None
    if data.actuator is not None and data.static_force is not None:
        found = calibrate_actuator(
            held,
            data.actuator,
            mechanism.motion,
            data.static_force,
            mechanism.calibration,
        )
        push, force, before = found.actuator_force, found.static_force, found.force_before
        if abs(push) > MOST_FORCE:
            raise InputError(
                f"its actuator {data.actuator!r} would need {push:.3g} N for its static force of "
                f"{force:g} N: it hardly acts on the arm {data.arm!r}; check its points"
            )
        system, motion = system.with_force_changed(data.actuator, force=push), found.motion
        mechanism.calibration = found
    else:
        motion, multipliers = equilibrium(held, mechanism.motion)
        force = before = float(multipliers[-1])
        if force <= 0.0:
            raise InputError(
                f"its static force is {force:.4g} N at its working height of {height:g} m: its "
                "actuators cannot raise it"
            )
    if mechanism.head is None or not _is_at(motion, mechanism.head[0]):
        head = _head(data, system, holder, motion)
        mechanism.head = motion, head, system.n_degrees_of_freedom(motion)
    _, head, n_freedoms = mechanism.head
    result = Standing(
        system, motion, mechanism.missed, height, force, push, before, n_freedoms, head
    )
    _log(data, result)
    return result


@dataclass
class _Mechanism:
    """A mechanism, also with a last joint that holds its arm at the ``height``, and its equilibrium
    for one static force, which serves for others: the calibration, the head with the place where it
    was measured and the number of freedoms there, and places of the arm."""

    missed: tuple[Miss, ...]
    system: System
    held: System
    height: float
    motion: Motion
    places: Raised | None = None
    calibration: Calibration | None = None
    head: tuple[Motion, Head, int] | None = None


@lru_cache(maxsize=64)
def _mechanism(data: MultibodyData) -> _Mechanism:
    """The pantograph assembled and judged, whatever its static force; errors as of ``stand``."""
    _judge_head(data)
    missed = _judge_positions(data)
    system = data.system
    motion = system.assemble(system.start())
    repeated = system.redundant(motion)
    if repeated:
        raise InputError(
            f"its joints {', '.join(repeated)} repeat, as often as said, what joints before them "
            "hold already; let them hold less, such as spherical in place of revolute"
        )
    height = data.working_height
    if height is None:
        height = float(motion.position[motion.numbers[data.arm], 2])
    holder = PrescribedPoint(HOLDER, data.arm, Constant(height))
    _judge_raising(data, motion)
    held = system.with_joints(holder)
    try:
        motion = _carried_along(data, motion, held.assemble(motion))
        motion = held.assemble(motion)
    except InputError as error:
        raise InputError(
            f"its arm {data.arm!r} does not reach its working height of {height:g} m: {error}"
        ) from error
    return _Mechanism(missed, system, held, height, motion)


def _carried_along(data: MultibodyData, before: Motion, after: Motion) -> Motion:
    """Motion ``after`` one of the arm, with the head as far from it as ``before``.

    Nothing but springs takes a head along: an arm that has risen past it would find it at rest
    below, where it hangs from them.
    """
    head, arm = before.numbers[data.head], before.numbers[data.arm]
    distance = [motion.position[head] - motion.position[arm] for motion in (before, after)]
    way = np.zeros((after.n_bodies, 6))
    way[head, :3] = distance[0] - distance[1]
    return after.moved(way.ravel())


def _bodies_of(data: MultibodyData) -> MultibodyData:
    """Data of the mechanism alone at standstill: no static force, no air."""
    kept = data.name, data.system, data.head, data.arm, data.working_height, data.actuator
    return MultibodyData(*kept, assembly_tolerance=data.assembly_tolerance)


def _is_at(motion: Motion, other: Motion) -> bool:
    """Whether bodies are where they are in another motion."""
    places = (motion.position, other.position), (motion.parameters, other.parameters)
    return all(np.allclose(one, another, 0.0, 1e-12) for one, another in places)


@lru_cache(maxsize=64)
def reduced(data: MultibodyData) -> ReducedMechanism:
    """The mechanism below the head, as far around its working height as it reaches.

    It carries the head along and across the track.
    """
    standing = stand(data)
    frame = without_head(data, standing.system)
    heights = standing.working_height + np.arange(-REACH, REACH + 0.5 * SPACING, SPACING)
    start, places = _part(standing.motion, frame), None
    if standing.actuator_force is not None:
        mechanism = _mechanism(_bodies_of(data))
        if mechanism.places is None:
            mechanism.places = Raised(frame, data.arm, actuator=data.actuator)
        places = mechanism.places
    return reduce_mechanism(
        frame,
        data.arm,
        heights,
        start=start,
        as_far_as_it_goes=True,
        tolerance=LIFT_TOLERANCE,
        name=data.name,
        blowing=_on_frame(data, standing.motion),
        places=places,
        riding=(standing.head.mass, _on_arm(data, standing.motion, np.zeros(3))),
    )


def head_lift(data: MultibodyData) -> float:
    """Lift of ``wind`` on the head [N]."""
    return float(sum(_vector(force)[2] for force in data.wind if force.body == data.head))


def arm_lift(data: MultibodyData) -> float:
    """Lift of ``wind`` on the mechanism at its arm, at the working height [N]."""
    return reduced(data).blown_at(stand(data).working_height) if data.wind else 0.0


def _on_frame(data: MultibodyData, motion: Motion) -> tuple[PointForce, ...]:
    """Forces of ``wind`` on the mechanism without its head, which slides on the arm: the arm holds
    the head against what blows it along and across the track."""
    forces = []
    for force in data.wind:
        along, across, _ = _vector(force)
        if force.body != data.head:
            forces.append(force)
        elif along or across:
            at = _on_arm(data, motion, np.asarray(force.at))
            forces.append(PointForce(force.name, data.arm, (along, across, 0.0), tuple(at)))
    return tuple(forces)


def _on_arm(data: MultibodyData, motion: Motion, at: np.ndarray) -> np.ndarray:
    """Place of a point of the head in the arm's axes (3,) [m]."""
    head, arm = motion.numbers[data.head], motion.numbers[data.arm]
    place = motion.position[head] + motion.rotation[head] @ at
    return np.asarray(motion.rotation[arm].T @ (place - motion.position[arm]))


def _vector(force: PointForce) -> np.ndarray:
    """A force of ``wind`` (3,) [N]."""
    assert not callable(force.force)
    return np.asarray(force.force, dtype=float)


def describe(data: MultibodyData) -> str:
    """Description of a pantograph, for people: bodies, freedoms, actuator, joints' misses."""
    standing, system = stand(data), data.system
    text = (
        f"multibody: {len(system.bodies)} bodies, {len(system.joints)} joints, 1 of "
        f"{standing.n_freedoms} degrees of freedom is the raising; arm at "
        f"{standing.working_height:.3f} m, head {standing.head.mass:.3g} kg on "
        f"{standing.head.stiffness:.4g} N/m"
    )
    if standing.actuator_force is not None:
        text += f"; {data.actuator} at {standing.actuator_force:.0f} N"
    text += f" for a static force of {standing.static_force:.1f} N"
    if data.all_bodies is None:
        return f"{text}; reduced to tables over its height"
    way = data.all_bodies
    cut = "" if way.substeps == 1 else f" in {way.substeps} substeps"
    return f"{text}; all bodies in the time loop{cut}, joints kept by {way.handling}"


def describe_assembly(missed: tuple[Miss, ...]) -> str:
    """Sentence on the gaps of joints in the given positions [mm]."""
    listed = ", ".join(f"{miss.joint} {1e3 * miss.gap:.1f} mm" for miss in missed)
    return f"closure errors of joints before assembly: {listed}"


def without_head(data: MultibodyData, system: System) -> System:
    """The mechanism that raises the arm, without the head and its suspension."""
    bodies = tuple(body for body in system.bodies if body.name != data.head)
    joints = tuple(joint for joint in system.joints if data.head not in bodies_on(joint))
    forces: list[Force] = []
    for force in system.forces:
        if isinstance(force, Gravity):
            forces.append(replace(force, masses=tuple(body.mass for body in bodies)))
        elif data.head not in bodies_on(force):
            forces.append(force)
    return System(bodies, joints, tuple(forces))


def _part(motion: Motion, system: System) -> Motion:
    """Motion of the bodies of a smaller system, taken from that of a larger one."""
    start = system.start()
    kept = [motion.numbers[name] for name in start.numbers]
    return replace(start, position=motion.position[kept], parameters=motion.parameters[kept])


def _head(data: MultibodyData, system: System, holder: Joint, motion: Motion) -> Head:
    """The head on its springs, measured around where it rests above the arm that is held."""
    held = system.with_joints(holder)
    number, arm = motion.numbers[data.head], motion.numbers[data.arm]
    rest = float(motion.position[number, 2])
    around = rest + TRAVEL * np.linspace(-1.0, 1.0, 5)
    try:
        tables = reduce_mechanism(held, data.head, around, start=motion)
    except (InputError, RunBroken) as error:
        raise InputError(
            f"its head {data.head!r} cannot move up and down on its arm {data.arm!r}: {error}"
        ) from error
    stiffness = -float(np.polyfit(around - rest, tables.lifts, 1)[0])
    # Forces on the head alone: its weight, and forces at its points.
    own = [force for force in held.other_forces if data.arm not in bodies_on(force)]
    pull = float(np.sum([f.generalised(motion, 0.0)[6 * number + 2] for f in own]))
    return Head(
        mass=float(tables.masses[2]),
        stiffness=stiffness,
        damping=float(tables.dampings[2]),
        weight=-pull,
        offset=rest - float(motion.position[arm, 2]),
        roll=_turning(data, system, motion, ROLL),
        pitch=_turning(data, system, motion, PITCH),
    )


def _judge_head(data: MultibodyData) -> None:
    """Raise ``InputError`` unless the head hangs on the arm alone, on linear springs."""
    allowed = {data.head, data.arm}
    for joint in data.system.joints:
        on = set(bodies_on(joint))
        if data.head in on and on != allowed:
            other = ", ".join(sorted(on - allowed)) or "space"
            raise InputError(
                f"its joint {joint.name!r} ties the head {data.head!r} to {other}; only the arm "
                f"{data.arm!r} may carry it"
            )
    if not any(set(bodies_on(joint)) == allowed for joint in data.system.joints):
        raise InputError(
            f"its head {data.head!r} is guided by no joint on its arm {data.arm!r}; there must be "
            "one that lets it slide, such as revolute_prismatic"
        )
    springs = 0
    for force in data.system.forces:
        on = set(bodies_on(force))
        if data.head not in on or len(on) == 1:
            continue
        if on != allowed:
            other = ", ".join(sorted(on - allowed))
            raise InputError(
                f"its force {force.name!r} acts between the head {data.head!r} and {other}; only "
                f"the arm {data.arm!r} may carry it"
            )
        if not isinstance(force, SpringDamper) or callable(force.stiffness):
            raise InputError(
                f"its force {force.name!r} acts between head and arm and must be a spring with a "
                "constant stiffness, because the head moves as a mass on a linear spring"
            )
        springs += force.stiffness > 0.0
    if not springs:
        raise InputError(
            f"its head {data.head!r} stands on no spring: there must be one between it and its "
            f"arm {data.arm!r}"
        )


def _judge_positions(data: MultibodyData) -> tuple[Miss, ...]:
    """Errors of the joints in the given positions; raises ``InputError`` if one misses too much."""
    missed = data.system.misses(data.system.start())
    worst = max(missed, key=lambda miss: max(miss.gap, miss.tilt))
    limit = data.assembly_tolerance
    if max(worst.gap, worst.tilt) > limit:
        much = f"{1e3 * worst.gap:.0f} mm" if worst.gap > limit else f"{worst.tilt:.2g} rad"
        raise InputError(
            f"its loops do not close: joint {worst.joint!r} misses by {much} in the given "
            f"positions, where {1e3 * limit:g} mm (or {limit:g} rad) are allowed; check its points"
        )
    return missed


def _judge_raising(data: MultibodyData, motion: Motion) -> None:
    """Raise ``InputError`` unless the mechanism has one way to move that forces act on: raising."""
    frame = without_head(data, data.system)
    there = _part(motion, frame)
    height = float(there.position[there.numbers[data.arm], 2])
    holder = PrescribedPoint(HOLDER, data.arm, Constant(height))
    held = frame.with_joints(holder)
    if held.n_degrees_of_freedom(there) == frame.n_degrees_of_freedom(there):
        raise InputError(
            f"its joints leave no way to raise the arm {data.arm!r}: take one away, or let it hold "
            "less"
        )
    left = unheld_force(held, there)
    if left > ADRIFT * Gravity.acceleration * sum(body.mass for body in frame.bodies):
        raise InputError(
            f"its mechanism has more than one way to move: with the arm {data.arm!r} held at its "
            f"height, forces of {left:.3g} N (or N m) still move it; join its bodies further"
        )


def _log(data: MultibodyData, standing: Standing) -> None:
    logger.debug("pantograph %s: %s", data.name, describe_assembly(standing.missed))
    if standing.actuator_force is not None:
        logger.debug(
            "pantograph %s: actuator %s calibrated to %.1f N, static force %.2f N (with the force "
            "of its data %.2f N)",
            data.name,
            data.actuator,
            standing.actuator_force,
            standing.static_force,
            standing.force_before,
        )


def _turning(data: MultibodyData, system: System, motion: Motion, about: int) -> Turning | None:
    """The head's roll or pitch, ``about`` its axis ``ROLL`` or ``PITCH``; None if its joints do not
    allow it.

    Of all motions of the head with a unit turn that with the least kinetic energy is taken. Springs
    are linear; the effect of weight and of tension in them on the turn is left out.
    """
    own = slice(6 * motion.numbers[data.head], 6 * motion.numbers[data.head] + 6)
    turn = np.zeros((1, 6))
    # Turns are counted in the head's axes.
    turn[0, 3:] = motion.rotation[motion.numbers[data.head]][about]
    jacobian = np.vstack([system.constraints(motion, 0.0).jacobian[:, own], turn])
    root = np.sqrt(system.inverse_mass[own])
    wanted = np.append(np.zeros(len(jacobian) - 1), 1.0)
    way = root * least_squares(jacobian * root, wanted, 1e-8)
    if np.abs(jacobian @ way - wanted).max() > _MISSED:
        return None
    stiffness = damping = 0.0
    for force in system.forces:
        if isinstance(force, SpringDamper) and data.head in (force.i, force.j):
            stretch, slope = float(gradient_of(force, motion)[own] @ way), force.stiffness
            if callable(slope):
                slope = (slope(_TRAVEL) - slope(-_TRAVEL)) / (2.0 * _TRAVEL)
            stiffness += slope * stretch**2
            damping += force.damping * stretch**2
    return Turning(float(system.mass[own] @ way**2), stiffness, damping)
