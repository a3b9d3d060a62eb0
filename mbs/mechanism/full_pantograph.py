"""A pantograph with all its bodies in the time loop: the reference for the reduced ones.

Steps are those of `implicit_steps`, so that joints stay closed, and the head's height at a step's
end is affine in the contact forces of the step. A vehicle that moves carries the base along: in the
base's axes all bodies weigh more by its acceleration, which is exact for a base that does not turn.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np

from catenary.base.errors import InputError, RunBroken
from catenary.mbs.air import ON_FRAME, ON_HEAD, SQUARE, AirForces
from catenary.mbs.head.pantograph import NO_TIME, Pantograph, weakly
from catenary.mbs.head.stepping import Part, Raising, Stepping
from catenary.mbs.mechanism.multibody_pantograph import MultibodyData, stand
from catenary.mbs.rigid.bodies import SPACE, Motion, body_products
from catenary.mbs.rigid.forces import PointForce
from catenary.mbs.rigid.implicit_steps import Stepper, StepSolver
from catenary.mbs.rigid.joints import Constant, PrescribedPoint, steady
from catenary.mbs.rigid.statics import equilibrium, held_force
from catenary.mbs.rigid.system import System, without_spins
from catenary.mbs.vehicle import BaseMotion, lifted
from catenary.solver.kernels import native

ARM, HEAD = "arm held at its place", "head moved from its place"
# To how well a place without contact is found [m].
PLACED = 1e-10


@dataclass(frozen=True)
class _Carried:
    """Inertia forces on bodies over a base that is accelerated up and sideways."""

    name: str
    masses: tuple[float, ...]
    base: BaseMotion

    def generalised(self, motion: Motion, time: float) -> np.ndarray:
        forces = np.zeros((len(self.masses), 6))
        forces[:, 1] = self.base.lateral(time).acceleration
        forces[:, 2] = self.base.vertical(time).acceleration
        return -(np.array(self.masses)[:, None] * forces).ravel()


def _blown(data: MultibodyData, air: AirForces | None) -> tuple[PointForce, ...]:
    """All forces of the air on bodies, as they act at a time."""
    if air is None:
        return ()

    def at_times(force: PointForce, column: int) -> PointForce:
        whole = np.asarray(force.force, dtype=float)
        return replace(force, force=lambda time: air.now(time)[column] * whole)

    forces = [at_times(force, SQUARE) for force in data.wind]
    if data.uplift is not None:
        for body, column in ((data.head, ON_HEAD), (data.arm, ON_FRAME)):
            forces.append(at_times(PointForce(f"uplift of {body}", body, (0.0, 0.0, 1.0)), column))
    return tuple(forces)


class FullPantograph(Pantograph):
    """All bodies of a multibody pantograph, implicit in the contact forces.

    Links between two balls do not spin, strips have no suspension of their own.

    Parameters
    ----------
    data : MultibodyData
    pressing : force [N] of the head on its arm, whose working height is that of a head at
        ``nominal_height`` [m]: the static force, and what the air lifts the arm with
    stepping : Stepping; without a ``lateral`` the wire crosses the strips in their middle
    air : forces of the air; without it there are none
    handling : way of keeping constraints, or its name in `implicit_steps.METHODS`
    substeps : into how many a step is cut

    Raises
    ------
    InputError
        The data's strips have a suspension of their own, or it cannot stand.
    """

    def __init__(
        self,
        data: MultibodyData,
        pressing: float,
        nominal_height: float,
        stepping: Stepping,
        air: AirForces | None = None,
        handling: StepSolver | str = "coordinate_partitioning",
        substeps: int = 1,
    ) -> None:
        if data.strips.suspension is not None:
            raise InputError(
                f"Pantograph {data.name!r}: strips with a suspension of their own are no bodies; "
                "leave it out to have all bodies in the loop."
            )
        standing = stand(data)
        raise_time, dt, beta, gamma, self._lateral, base = stepping
        super().__init__(data.strips.contact_offsets, base)
        self._data, self._dt = data, dt
        # Part of the lift that acts, and what holds the arm down without any of it [N].
        self._part: Part = Raising(raise_time)
        self._held = 0.0
        still = without_spins(standing.system, standing.motion)
        self._still = still.with_forces(*_blown(data, air))
        system = self._still.with_forces(
            PointForce("held down until raised", data.arm, self._holding)
        )
        if base is not None:
            masses = tuple(body.mass for body in system.bodies)
            system = system.with_forces(_Carried("carried by the base", masses, base))
        self._rest = standing.motion
        # Heights of the head above the base, with the arm at its working height.
        alone = float(standing.motion.position[standing.motion.numbers[data.head], 2])
        self._foot = nominal_height - (alone - pressing / standing.head.stiffness)
        s, space = len(self.strip_offsets), self._rest.numbers[SPACE]
        # Heights of the points that touch the wire.
        self._heights = np.zeros(s, dtype=native.BODY_PRODUCT)
        self._heights["body"], self._heights["normal"] = space, (0.0, 0.0, 1.0)
        self._heights["start"], self._heights["end"] = space, self._rest.numbers[data.head]
        self._heights["between"] = True
        self._points = self._heights["at_end"]
        self._points[:, 0] = self.strip_offsets
        # Generalised forces (6 n, s) of unit contact forces, downward.
        pushed = lambda motion: -self._touching(motion)[1].T  # noqa: E731
        self._stepper = Stepper(system, dt, handling, pushed, substeps, beta, gamma)
        self._stepper.begin(standing.motion, 0.0)
        self._early = np.zeros((2, s))
        self._bodies = np.zeros(7 * self.motion.n_bodies)
        # It has no coordinates that kernels know.
        none = np.zeros((2, s, 0)), np.zeros(0)
        arrays = native.HeadArrays(*none, self.head.numbers, NO_TIME, -1)
        self.stepped = native.CalledHead(arrays, weakly(self._predict))
        self.stepped.then(weakly(self._advance))
        self._note()

    @property
    def system(self) -> System:
        """The bodies with all that acts on them but the contact forces."""
        return self._stepper.system

    @property
    def motion(self) -> Motion:
        """Positions of all bodies, from the base."""
        return self._stepper.motion

    def follow(self, part: Part) -> None:
        self._part = part

    def _holding(self, time: float) -> tuple[float, float, float]:
        """What holds the arm down until the pantograph is raised [N]."""
        return 0.0, 0.0, -self._held * (1.0 - float(self._part(time)))

    def _place(self, head_height: float, velocity: float) -> None:
        """``velocity`` is that of head and arm, all other bodies as the joints require. Both count
        from the line, also where the base moves."""
        try:
            self._place_on_arm(head_height, velocity)
        except InputError as error:
            raise self._beyond_reach(head_height) from error
        self._note()

    def _place_on_arm(self, head_height: float, velocity: float) -> None:
        data, number = self._data, self._rest.numbers[self._data.head]
        lift, rising = lifted(self._base, 0.0)
        wanted, velocity = head_height - self._foot - lift, velocity - rising
        motion = self._rest
        arm = wanted - stand(data).head.offset
        for _ in range(20):
            holder = PrescribedPoint(ARM, data.arm, Constant(arm))
            motion = equilibrium(self._still.with_joints(holder), motion).motion
            off = wanted - float(motion.position[number, 2])
            arm += off
            if abs(off) <= PLACED:
                break
        else:
            raise self._beyond_reach(head_height)
        self._held = held_force(self._still, holder, motion)
        if velocity:
            raising = self._still.with_joints(
                PrescribedPoint(ARM, data.arm, steady(arm, velocity)),
                PrescribedPoint(HEAD, data.head, steady(wanted, velocity)),
            )
            motion = raising.project_velocities(motion, 0.0)
        self._aim(0.0)
        self._stepper.begin(motion, 0.0)

    def _extrapolate(self, time: float) -> tuple[np.ndarray, np.ndarray]:
        self._aim(time)
        dt, stepper = self._dt, self._stepper
        heights, gradients = self._touching(stepper.motion)
        velocities, pushed = stepper.motion.velocities, stepper.acceleration
        self._early[0] = self._foot + heights
        self._early[0] += gradients @ (dt * velocities + 0.5 * dt**2 * pushed)
        self._early[1] = gradients @ (velocities + dt * pushed)
        self._add_base(time, self._early[0], self._early[1], stepper.motion)
        return self._early[0], self._early[1]

    def _predict(self, time: float) -> None:
        """Fill in the strips at ``time`` [s]."""
        self._aim(time)
        # The loop's clock counts: a restart begins at any time.
        self._stepper.time = time - self._dt
        with self._named():
            found = self._stepper.predict(time)
        displacement, velocity, _ = found.changes(np.zeros(len(self._points)))
        heights, gradients = self._touching(found.motion)
        head = self.head
        head.height[:] = self._foot + heights + gradients @ displacement
        head.velocity[:] = gradients @ (found.motion.velocities + velocity)
        head.height_compliance[:] = -gradients @ found.by_force[0]
        head.velocity_compliance[:] = -gradients @ found.by_force[1]
        self._add_base(time, head.height, head.velocity, found.motion)

    def _advance(self, time: float, contact_force: np.ndarray) -> None:
        """Take the step to ``time`` [s]; RunBroken if joints cannot be kept closed, or numbers are
        not finite."""
        with self._named():
            self._stepper.advance(contact_force)
        self._note()

    def _note(self) -> None:
        """Note where bodies are now, and how open joints are."""
        motion = self.motion
        np.concatenate(
            [motion.position[:-1].ravel(), motion.parameters[:-1].ravel()], out=self._bodies
        )
        self.violation[0] = self._stepper.violation()

    def _own_state(self) -> list[np.ndarray]:
        """Places, velocities, accelerations, contact forces, and what holds it down."""
        stepper = self._stepper
        held = np.array([self._held])
        return [stepper.motion.to_vector(), stepper.acceleration, stepper.forces, held]

    def _restore(self, state: np.ndarray) -> None:
        stepper, n = self._stepper, self.motion.n_bodies
        stepper.motion = stepper.motion.restored(state[: 13 * n])
        stepper.acceleration = state[13 * n : 19 * n]
        stepper.forces = state[19 * n : -1]
        self._held = float(state[-1])
        self._note()

    def places(self) -> np.ndarray:
        return self._bodies

    @contextmanager
    def _named(self) -> Iterator[None]:
        """Add the pantograph's name to the error message."""
        try:
            yield
        except RunBroken as error:
            raise type(error)(f"Pantograph {self._data.name!r}: {error}") from error

    def _beyond_reach(self, head_height: float) -> RunBroken:
        return RunBroken(
            f"The head of pantograph {self._data.name!r} does not reach a wire at a height of "
            f"{head_height:.4g} m: {head_height - self._foot:.4g} m above its base."
        )

    def _aim(self, time: float) -> None:
        """Set the place of the wire on the strips at ``time`` [s]."""
        if self._lateral is not None:
            self._lateral.move_to(time)
            self._points[:, 1] = self._lateral.place

    def _touching(self, motion: Motion) -> tuple[np.ndarray, np.ndarray]:
        """Heights (s,) above the base where the wire is on the strips, and gradients (s, 6 n)."""
        found = body_products(motion, self._heights)
        return found.value, found.jacobian

    def _add_base(
        self, time: float, height: np.ndarray, velocity: np.ndarray, motion: Motion
    ) -> None:
        """Add the base's motion and the wire's way along the strips, in place."""
        if self._lateral is not None:
            tilt = motion.rotation[motion.numbers[self._data.head]][2, 1]
            velocity += tilt * self._lateral.rate
        lift, rising = lifted(self._base, time)
        height += lift
        velocity += rising
