"""A system of bodies, joints and forces: its equations of motion, reactions and assembly.

    [M  Phi_q^T] [dv/dt ]   [g    ]
    [Phi_q    0] [lambda] = [gamma]        (3.6)

in velocities v and angular velocities in body axes, so that M is constant, block diagonal and
regular, and Euler parameters need no equation but their rates and p^T p = 1. Joints act on bodies
with -Phi_q^T lambda.

Least squares and null spaces of its small matrices are found by QR with pivoting (LAPACK's gelsy
and geqp3). SciPy's defaults find singular values by divide and conquer, which fails on a rare
matrix however well conditioned it is ("SVD did not converge"; seen with 36 equations in 34 unknowns
whose singular values are 0.02 to 3).

A system may be set up the other way round, by half a turn about the vertical: bodies, joints and
forces between them are the same; what is given in space (places, orientations, points and axes of
joints to the ground) turns with them. Forces whose direction is fixed in space, such as the wind's,
keep it: they meet a pantograph that runs knee first where they met one that runs knee trailing.

The idle rotation of links between two balls may be locked. Nothing drives such a spin and little
resists it; a link whose mass lies above the line between its balls tips over by itself, which no
real link with its bolts does. Reduced mechanisms leave spins out; locks leave them out of systems
with all bodies.

Sources: P. E. Nikravesh, 1988, chapters 6 and 11; Ambrosio et al., 2012, equation (3.6).
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from scipy import linalg

from catenary.base.errors import InputError, RunBroken
from catenary.mbs.rigid.bodies import SPACE, Body, Motion, Quantity, Vector, initial_motion
from catenary.mbs.rigid.forces import BetweenPoints, FlatLines, Force, OffLine
from catenary.mbs.rigid.joints import (
    Fixed,
    FlatRows,
    Joint,
    PointOnCurve,
    PrescribedAngle,
    PrescribedPoint,
    Spherical,
)
from catenary.solver.kernels import native

# A row of Phi_q that the rows before it explain but for this part of its length is redundant.
DEPENDENT = 1e-8
# Error of a row of a joint that is closed [m, cosine; 1/s], within 1 m of the origin.
CLOSED = 1e-12
# Of Newton's method that closes joints.
_MOST_ITERATIONS = 30
_ACROSS_TRACK, _ALONG_TRACK = np.array([0.0, 1.0, 0.0]), np.array([1.0, 0.0, 0.0])
# A link closer than this to the direction across the track (a sine) is measured along it.
_CLOSE = 0.1


class Miss(NamedTuple):
    """Error of an open joint: ``gap`` [m], and ``tilt``, cosines off right angles."""

    joint: str
    gap: float
    tilt: float


class Accelerations(NamedTuple):
    """``acceleration`` (6 n,) [m/s^2, rad/s^2]; ``multipliers`` (m,), zero for redundant rows."""

    acceleration: np.ndarray
    multipliers: np.ndarray


def closed_within(motion: Motion) -> float:
    """Error of a row of a joint that is closed [m, cosine]: what round-off allows, which grows with
    the distance from the origin."""
    return CLOSED * max(1.0, float(np.abs(motion.position).max()))


def independent_rows(jacobian: np.ndarray) -> np.ndarray:
    """Numbers of rows, from the first on, that are not combinations of rows before them.

    Gram-Schmidt row by row, so that the first of several dependent rows is kept.
    """
    found = native.independent_rows(np.ascontiguousarray(jacobian), DEPENDENT)
    return np.array(found, dtype=np.int64)


@dataclass(frozen=True)
class System:
    """Bodies with what joins them and acts on them. Not changed by what is computed from it."""

    bodies: tuple[Body, ...]
    joints: tuple[Joint, ...]
    forces: tuple[Force, ...] = ()

    def __post_init__(self) -> None:
        names = [joint.name for joint in self.joints] + [force.name for force in self.forces]
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise InputError(f"Joints and forces must have different names: {twice}.")

    def start(self) -> Motion:
        """All bodies at rest where their data put them; joints need not be closed."""
        return initial_motion(self.bodies)

    def with_joints(self, *joints: Joint) -> System:
        """Return this system with further joints."""
        return replace(self, joints=(*self.joints, *joints))

    def with_forces(self, *forces: Force) -> System:
        """Return this system with further forces."""
        return replace(self, forces=(*self.forces, *forces))

    def force(self, name: str) -> Force:
        """The force of this name; raises InputError if there is none."""
        for force in self.forces:
            if force.name == name:
                return force
        raise InputError(f"There is no force {name!r} among {[f.name for f in self.forces]}.")

    def with_force_changed(self, name: str, **changes: Any) -> System:
        """Return this system with other values in the force of this name."""
        self.force(name)
        changed = replace(
            self,
            forces=tuple(
                replace(force, **changes) if force.name == name else force  # type: ignore[type-var]
                for force in self.forces
            ),
        )
        changed.__dict__["_rows"] = self._rows  # of the same joints
        return changed

    @cached_property
    def inverse_mass(self) -> np.ndarray:
        """1 / M, which is diagonal in principal axes, shape (6 n,)."""
        result = 1.0 / self.mass
        result.flags.writeable = False
        return result

    @cached_property
    def mass(self) -> np.ndarray:
        """M, which is diagonal in principal axes, shape (6 n,) [kg, kg m^2]."""
        result = np.concatenate([[b.mass] * 3 + list(b.inertia) for b in self.bodies])
        result.flags.writeable = False
        return result

    def constraints(self, motion: Motion, time: float) -> Quantity:
        """Phi of all joints with its derivatives, m rows."""
        return self._rows(motion, time)

    @cached_property
    def _rows(self) -> FlatRows:
        return FlatRows(self.joints, self.start())

    @cached_property
    def lines(self) -> FlatLines:
        """The forces between points."""
        return FlatLines(self.forces, self.start())

    @cached_property
    def other_forces(self) -> tuple[OffLine, ...]:
        """All other forces."""
        return tuple(force for force in self.forces if not isinstance(force, BetweenPoints))

    @cached_property
    def _inertia(self) -> np.ndarray:
        return np.array([body.inertia for body in self.bodies], dtype=float).reshape(-1, 3)

    def generalised_forces(self, motion: Motion, time: float) -> np.ndarray:
        """g (6 n,) [N, N m]: all forces, and the gyroscopic moments -omega x J omega."""
        length, rate, gradient = self.lines.geometry(motion)
        result = self.lines.pulls(length, rate) @ -gradient
        for force in self.other_forces:
            result += force.generalised(motion, time)
        native.add_gyroscopic_moments(result, self._inertia, motion.spin)
        return result

    def accelerations(
        self, motion: Motion, time: float, more_forces: np.ndarray | float = 0.0
    ) -> Accelerations:
        """Solve (3.6) under forces of the system and ``more_forces`` (6 n,) [N, N m].

        Raises
        ------
        RunBroken
            Accelerations are not finite.
        """
        rows = self.constraints(motion, time)
        force, softness = self.generalised_forces(motion, time) + more_forces, self.inverse_mass
        kept = independent_rows(rows.jacobian)
        jacobian = rows.jacobian[kept]
        multipliers = np.zeros(len(rows.value))
        if len(kept):
            schur = (jacobian * softness) @ jacobian.T
            right = jacobian @ (softness * force) + rows.drift[kept]
            multipliers[kept] = linalg.solve(schur, right, assume_a="pos")
        acceleration = softness * (force - rows.jacobian.T @ multipliers)
        if not np.isfinite(acceleration).all():
            raise RunBroken(
                f"The multibody system has no finite accelerations at {time:g} s: "
                "reduce the forces or check the joints."
            )
        return Accelerations(acceleration, multipliers)

    @property
    def row_ranges(self) -> dict[str, slice]:
        """Ranges of rows by joint."""
        return self._rows.ranges

    def redundant(self, motion: Motion) -> tuple[str, ...]:
        """Names of joints with rows that joints before them imply, with how many: 'hinge (3)'."""
        jacobian = self.constraints(motion, 0.0).jacobian
        kept = set(independent_rows(jacobian))
        counts = {
            name: sum(row not in kept for row in range(rows.start, rows.stop))
            for name, rows in self.row_ranges.items()
        }
        return tuple(f"{name} ({count})" for name, count in counts.items() if count)

    def n_degrees_of_freedom(self, motion: Motion) -> int:
        """6 n less the rank of the joints' Jacobian."""
        return 6 * motion.n_bodies - len(independent_rows(self.constraints(motion, 0.0).jacobian))

    def misses(self, motion: Motion, time: float = 0.0) -> tuple[Miss, ...]:
        """Errors of all joints."""
        found, result = self.constraints(motion, time).value, []
        for joint in self.joints:
            error = found[self.row_ranges[joint.name]]
            gap, tilt = error[: joint.n_lengths], error[joint.n_lengths :]
            result.append(Miss(joint.name, float(np.linalg.norm(gap)), float(np.linalg.norm(tilt))))
        return tuple(result)

    def assemble(self, motion: Motion, time: float = 0.0) -> Motion:
        """Close all joints by the smallest displacements (position projection).

        Newton's method; redundant rows do no harm. Velocities stay as they are.

        Parameters
        ----------
        motion : Motion
            Places to start from, and velocities that are kept.
        time : float, optional
            Time of prescribed motions [s].

        Raises
        ------
        InputError
            The joints cannot be closed from there; it names the one that misses most.
        """
        if not self.joints:
            return motion
        limit = closed_within(motion)
        for _ in range(_MOST_ITERATIONS + 1):
            rows = self.constraints(motion, time)
            if np.abs(rows.value).max() <= limit:
                return motion
            step = least_squares(rows.jacobian, -rows.value, DEPENDENT)
            # Newton's method must not turn bodies around on its way.
            motion = motion.moved(step / max(1.0, float(np.abs(step).max())))
        worst = max(self.misses(motion, time), key=lambda miss: max(miss.gap, miss.tilt))
        raise InputError(
            f"The joints cannot be closed at {time:g} s: joint {worst.joint!r} misses by "
            f"{worst.gap:.3g} m and {worst.tilt:.3g} (cosine); check its points and axes."
        )

    def project_velocities(self, motion: Motion, time: float = 0.0) -> Motion:
        """The velocities that joints allow, nearest in kinetic energy (velocity projection).

        Raises
        ------
        InputError
            No velocities satisfy all joints, because prescribed motions contradict each other.
        """
        if not self.joints:
            return motion
        rows = self.constraints(motion, time)
        scale = np.sqrt(self.inverse_mass)
        step = scale * least_squares(rows.jacobian * scale, -rows.rate, DEPENDENT)
        velocities = motion.velocities + step
        left = np.abs(rows.rate + rows.jacobian @ step).max()
        if left > 1e-8 * (1.0 + np.abs(velocities).max()):
            raise InputError(
                f"Prescribed motions contradict each other at {time:g} s: "
                f"velocities miss by {left:.3g} m/s or 1/s."
            )
        return motion.with_velocities(velocities)


def bodies_on(what: Joint | Force) -> tuple[str, ...]:
    """Names of the bodies that a joint or force is on."""
    names = (getattr(what, key, None) for key in ("i", "j", "body"))
    return tuple(name for name in names if name is not None)


def least_squares(matrix: np.ndarray, right: np.ndarray, cond: float) -> np.ndarray:
    """The smallest x (n,) or (n, k) for which ``matrix`` (m, n) x is nearest to ``right``.

    Directions in which the matrix is smaller than ``cond`` of its size count as none. By QR with
    pivoting, which iterates nothing.
    """
    return np.asarray(
        linalg.lstsq(matrix, right, cond=cond, lapack_driver="gelsy", check_finite=False)[0]
    )


def null_space(matrix: np.ndarray) -> np.ndarray:
    """Orthonormal basis (n, k) of the null space of ``matrix`` (m, n).

    Products with it are below 1e-8 of the largest row of the matrix. By QR of the rows with
    pivoting: a third of the time of singular values.
    """
    if not matrix.size:
        return np.eye(matrix.shape[1])
    columns, triangle, _ = linalg.qr(matrix.T, pivoting=True, check_finite=False)
    sizes = np.abs(np.diagonal(triangle))
    rank = int((sizes > 1e-8 * sizes.max(initial=0.0)).sum())
    return np.asarray(columns[:, rank:])


def turned_round(system: System) -> System:
    """Return a system after half a turn about the z axis of space. Not collective."""
    return System(
        tuple(_turned_body(body) for body in system.bodies),
        tuple(_turned_joint(joint) for joint in system.joints),
        tuple(_turned_force(force) for force in system.forces),
    )


def _turned_vector(vector: Vector) -> tuple[float, float, float]:
    """A vector of space after half a turn."""
    x, y, z = (float(value) for value in vector)
    return (-x, -y, z)


def _turned_parameters(parameters: np.ndarray) -> tuple[float, ...]:
    """Euler parameters (4,) of an orientation in space after half a turn, e0 >= 0."""
    e0, e1, e2, e3 = (float(value) for value in parameters)
    after = (-e3, -e2, e1, e0)
    return tuple(-value for value in after) if after[0] < 0.0 else after


def _turned_body(body: Body) -> Body:
    turn = _turned_parameters(body.parameters)[1:]
    return replace(body, position=_turned_vector(body.position), turn=turn)


def _turned_joint(joint: Joint) -> Joint:
    if isinstance(joint, PointOnCurve):
        # Curves are given for growing x.
        x, y = (tuple(-float(v) for v in reversed(values)) for values in (joint.x, joint.y))
        return replace(joint, x=x, y=y, z=tuple(reversed(tuple(joint.z))))
    if isinstance(joint, PrescribedPoint):
        return replace(joint, along=_turned_vector(joint.along))
    changes = _in_space(joint)
    if isinstance(joint, Fixed) and joint.i == SPACE:
        changes["parameters"] = _turned_parameters(np.asarray(joint.parameters, dtype=float))
    return replace(joint, **changes)  # type: ignore[type-var]


def _turned_force(force: Force) -> Force:
    return replace(force, **_in_space(force)) if isinstance(force, BetweenPoints) else force


def _in_space(what: Any) -> dict[str, Any]:
    """Points and axes of a joint or force that are those of space, after half a turn."""
    return {
        field.name: _turned_vector(getattr(what, field.name))
        for field in fields(what)
        for end in ("i", "j")
        if field.name.endswith(f"_{end}") and getattr(what, end) == SPACE
    }


def without_spins(system: System, motion: Motion) -> System:
    """The system with a joint more for each body that only two balls hold.

    The joint keeps a vector of the body, across the line between its balls, perpendicular to the
    direction across the track (or along it, for a link across): one row each, which lets a
    mechanism move in its plane as before.

    Parameters
    ----------
    system : System
        Bodies with their joints and forces.
    motion : Motion
        Assembled motion, whose spins are kept.
    """
    locks = (_spin_lock(system, body, motion) for body in system.bodies)
    return system.with_joints(*(lock for lock in locks if lock is not None))


def _spin_lock(system: System, body: Body, motion: Motion) -> PrescribedAngle | None:
    joints = [joint for joint in system.joints if body.name in bodies_on(joint)]
    if len(joints) != 2 or not all(isinstance(joint, Spherical) for joint in joints):
        return None
    ends = [
        np.asarray(joint.at_i if joint.i == body.name else joint.at_j, dtype=float)
        for joint in joints
        if isinstance(joint, Spherical)
    ]
    rotation = motion.rotation[motion.numbers[body.name]]
    line = rotation @ (ends[1] - ends[0])
    length = float(np.linalg.norm(line))
    if length == 0.0:
        return None
    fixed = _ACROSS_TRACK
    if np.linalg.norm(np.cross(line / length, fixed)) < _CLOSE:
        fixed = _ALONG_TRACK
    side = np.cross(line, fixed)
    side /= np.linalg.norm(side)
    # The angle zero of `PrescribedAngle` about an axis a with a normal n has the row
    # (a x n) . vector = 0: here a x n is the fixed direction.
    axis = np.cross(side, fixed)
    return PrescribedAngle(
        f"no spin of {body.name}",
        SPACE,
        body.name,
        0.0,
        axis_i=tuple(axis),
        normal_i=tuple(side),
        normal_j=tuple(rotation.T @ side),
    )
