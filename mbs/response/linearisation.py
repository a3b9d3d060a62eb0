"""Small motions around rest: M x'' + C x' + K x = b f, of bodies with joints or of lumped masses.

The motions x of a multibody system are velocities that its joints allow, chosen so that M = 1.
Forces are differentiated along them with all joints kept closed, so that K holds springs, weights
and what constant forces do when their levers change.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy import linalg

from catenary.base.errors import InputError, RunBroken
from catenary.mbs.head.strips import Strips, Suspension, head_parts
from catenary.mbs.lumped_data import LumpedData
from catenary.mbs.rigid.arrays import ORIGIN
from catenary.mbs.rigid.bodies import Motion, Vector
from catenary.mbs.rigid.joints import unit
from catenary.mbs.rigid.kinematics import point
from catenary.mbs.rigid.least_squares import null_space
from catenary.mbs.rigid.statics import force_on_ways
from catenary.mbs.rigid.system import System

# Largest displacement [m or rad] and velocity [m/s or rad/s] for differences of forces.
STEP, SPEED = 1e-5, 1e-4
# Motions that less than this part of the largest stiffness, damping and load acts on are left out.
NEUTRAL = 1e-8
# A force left on a free motion above this part of the largest one (or of 1 N): not at rest.
UNBALANCED = 1e-6


class Mode(NamedTuple):
    """A free motion exp(s t): ``root`` s [1/s] with Im s >= 0; a real root is a mode of its own.

    ``share``: how much of the mode the point that is loaded moves, in parts of the largest mode's.
    """

    root: complex
    share: float

    @property
    def frequency(self) -> float:
        """|s| / 2 pi [Hz]: the undamped natural frequency."""
        return abs(self.root) / (2.0 * np.pi)

    @property
    def damping_ratio(self) -> float:
        """-Re s / |s|: 1 for a motion that dies out without swinging, < 0 for one that grows."""
        return -self.root.real / abs(self.root) if self.root else 0.0


@dataclass(frozen=True)
class LinearModel:
    """M x'' + C x' + K x = b f, and the displacement b^T x of the loaded point.

    ``mass``, ``damping``, ``stiffness`` (k, k); ``push`` b (k,), positive upward like the
    displacement. ``ways`` (n, k): what the motions x do to bodies, as `Motion` counts their
    displacements, or to lumped masses. ``left_out``: bodies that also move in motions which
    nothing resists and the load does not drive; there are ``n_left_out`` of those.
    """

    mass: np.ndarray
    damping: np.ndarray
    stiffness: np.ndarray
    push: np.ndarray
    ways: np.ndarray
    left_out: tuple[str, ...] = ()
    n_left_out: int = 0

    def amplitudes(self, frequencies: Vector) -> np.ndarray:
        """Complex amplitudes (n_f, k) of x for a unit force exp(i w t) at frequencies (n_f,) [Hz].

        Raises
        ------
        InputError
            A frequency at which an undamped motion has no bounded response.
        """
        omega = 2.0 * np.pi * np.asarray(frequencies, dtype=float)[:, None, None]
        dynamic = self.stiffness - omega**2 * self.mass + 1j * omega * self.damping
        right = np.broadcast_to(self.push[:, None], (*dynamic.shape[:2], 1))
        try:
            return np.linalg.solve(dynamic, right)[..., 0]
        except np.linalg.LinAlgError as error:
            raise InputError(
                "There is no response at one of the frequencies: nothing resists the load there."
            ) from error

    def receptance(self, frequencies: Vector) -> np.ndarray:
        """Complex displacement of the loaded point per unit force on it (n_f,) [m/N].

        Both upward: at frequencies (n_f,) [Hz] far below all natural ones of a held system it is
        real and positive, its compliance.
        """
        return self.amplitudes(frequencies) @ self.push

    def modes(self) -> tuple[Mode, ...]:
        """Free motions by growing frequency."""
        k = len(self.push)
        inverse = linalg.inv(self.mass)
        companion = np.block(
            [
                [np.zeros((k, k)), np.eye(k)],
                [-inverse @ self.stiffness, -inverse @ self.damping],
            ]
        )
        roots, shapes = linalg.eig(companion)
        sizes = np.sqrt(np.einsum("im,ij,jm->m", shapes[:k].conj(), self.mass, shapes[:k]).real)
        shares = np.abs(self.push @ shapes[:k]) / np.maximum(sizes, np.finfo(float).tiny)
        largest = shares.max(initial=0.0) or 1.0
        found = [
            Mode(complex(root), float(share / largest))
            for root, share in zip(roots, shares, strict=True)
            if root.imag >= 0.0
        ]
        # Opposite roots differ by round-off only.
        return tuple(sorted(found, key=lambda one: (float(f"{abs(one.root):.6g}"), one.root.real)))


def of_chain(data: LumpedData) -> LinearModel:
    """Lumped masses, loaded at the head."""
    push = np.zeros(data.n_masses)
    push[0] = 1.0
    return LinearModel(
        np.diag(np.asarray(data.masses, dtype=float)),
        data.chain(data.dampings),
        data.chain(data.stiffnesses),
        push,
        np.eye(data.n_masses),
    )


def with_strips(model: LinearModel, strips: Strips) -> LinearModel:
    """Return a model with its strips on their own springs, loaded on all of them alike.

    The strips' masses are part of what the model's loaded point carries; they move, and bend, as
    one, and are loaded in their middle.
    """
    sprung, flexure, n = strips.suspension, strips.flexure, strips.number
    if sprung is None:
        return model
    own_mass = n * sprung.mass
    if flexure is not None:
        flexure = replace(flexure, stiffness=n * flexure.stiffness)
    own = Suspension(own_mass, n * sprung.stiffness, n * sprung.damping)
    as_one = Strips(1, length=strips.length, suspension=own, flexure=flexure)
    # Coordinates are the strip's height, the head's, and the strip's modes.
    parts, head = head_parts(2.0 * own_mass, 0.0, 0.0, as_one), 1
    masses = parts.masses.copy()
    masses[head] = -own_mass
    k, more = model.push.size, parts.n - 1
    ways = np.zeros((parts.n, k + more))
    ways[head, :k] = model.push
    ways[np.delete(np.arange(parts.n), head), k + np.arange(more)] = 1.0

    def grown(matrix: np.ndarray, of_strips: np.ndarray) -> np.ndarray:
        return np.asarray(np.pad(matrix, (0, more)) + ways.T @ of_strips @ ways)

    return replace(
        model,
        mass=grown(model.mass, np.diag(masses)),
        damping=grown(model.damping, parts.damping[:-1, :-1]),
        stiffness=grown(model.stiffness, parts.stiffness[:-1, :-1]),
        push=parts.touch[0] @ ways,
        ways=np.pad(model.ways, ((0, 0), (0, more))),
    )


def linearise(
    system: System,
    motion: Motion,
    body: str,
    at: Vector = ORIGIN,
    along: Vector = (0.0, 0.0, 1.0),
) -> LinearModel:
    """Small motions of a system at rest, loaded at a point of a body along a direction in space.

    Not collective. Of a damper whose force has a kink at rest the mean of both slopes counts.

    Parameters
    ----------
    system : System
        Bodies with their joints and forces.
    motion : Motion
        The system at rest, forces that are always there (the wire's) included in it.
    body : str
        Name of the body that is loaded.
    at : array_like, shape (3,), optional
        Loaded point in the axes of the body [m].
    along : array_like, shape (3,), optional
        Direction of the load in space [-].

    Raises
    ------
    InputError
        The system is not at rest there, or its joints do not let the point move that way.
    """
    rest = motion.with_velocities(np.zeros(6 * motion.n_bodies))
    free = null_space(system.constraints(rest, 0.0).jacobian)
    push = unit(along) @ point(rest, body, at).jacobian @ free
    if np.abs(push).max(initial=0.0) < 1e-9:
        raise InputError(f"The joints do not let body {body!r} move along {tuple(along)}.")
    forces = system.generalised_forces(rest, 0.0)
    unbalanced = np.abs(free.T @ forces).max()
    if unbalanced > UNBALANCED * (1.0 + np.abs(forces).max()):
        raise InputError(
            f"The multibody system is not at rest where it is to be linearised: {unbalanced:.3g} N "
            "are left over."
        )
    # Motions of unit mass: y^T y is twice the kinetic energy.
    lower = linalg.cholesky(free.T @ (system.mass[:, None] * free), lower=True)
    ways = linalg.solve_triangular(lower, free.T, lower=True).T
    push = linalg.solve_triangular(lower, push, lower=True)
    stiffness = _resistance(
        lambda displacement: force_on_ways(system, rest.moved(displacement), ways), ways, STEP
    )

    def damped(velocities: np.ndarray) -> np.ndarray:  # gyroscopic moments cancel out at rest
        return ways.T @ system.generalised_forces(rest.with_velocities(velocities), 0.0)

    damping = _resistance(damped, ways, SPEED)
    kept, dropped = _separated(stiffness, damping, push)
    return LinearModel(
        np.eye(kept.shape[1]),
        kept.T @ damping @ kept,
        kept.T @ stiffness @ kept,
        kept.T @ push,
        ways @ kept,
        _moved_bodies(system, ways @ dropped),
        dropped.shape[1],
    )


def _resistance(
    force: Callable[[np.ndarray], np.ndarray], ways: np.ndarray, most: float
) -> np.ndarray:
    """-df/dx (k, k) of forces (k,) that displacements or velocities (6 n,) make, by central
    differences of at most ``most`` along ``ways`` (6 n, k)."""
    result = np.empty((ways.shape[1],) * 2)
    for k, way in enumerate(ways.T):
        step = most / float(np.abs(way).max())
        ahead, behind = (force(sign * step * way) for sign in (1.0, -1.0))
        result[:, k] = (behind - ahead) / (2.0 * step)
    return result


def _separated(
    stiffness: np.ndarray, damping: np.ndarray, push: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Bases (k, .) of the motions that forces act on, and of the motions without forces.

    With M = 1 the two are not coupled.
    """
    acting = []
    for matrix in (stiffness, stiffness.T, damping, damping.T, push[None, :]):
        size = np.abs(matrix).max()
        if size > 0.0:
            acting.append(matrix / size)
    left, sizes, right = linalg.svd(np.vstack(acting), lapack_driver="gesvd")
    n_kept = int(np.sum(sizes > NEUTRAL * sizes[0]))
    return right[:n_kept].T, right[n_kept:].T


def _moved_bodies(system: System, ways: np.ndarray) -> tuple[str, ...]:
    """Names of bodies that take part in motions ``ways`` (6 n, k)."""
    if not ways.shape[1]:
        return ()
    sizes = np.abs(ways.reshape(len(system.bodies), -1)).max(axis=1)
    return tuple(
        body.name
        for body, size in zip(system.bodies, sizes, strict=True)
        if size > 1e-3 * sizes.max()
    )


def apparent_mass(frequencies: Vector, receptance: np.ndarray) -> np.ndarray:
    """-1 / (w^2 H) (n_f,) [kg]: the mass that would move as far at frequencies (n_f,) [Hz]."""
    omega = 2.0 * np.pi * np.asarray(frequencies, dtype=float)
    if np.any(omega <= 0.0):
        raise RunBroken("An apparent mass is asked for at a frequency that is not positive.")
    return -1.0 / (omega**2 * receptance)
