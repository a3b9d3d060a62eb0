"""Linearisation, frequency response, and the lumped model fitted to it.

Small motions around rest are M x'' + C x' + K x = b f, of bodies with joints or of lumped masses.
The motions x of a multibody system are velocities that its joints allow, chosen so that M = 1.
Forces are differentiated along them with all joints kept closed, so that K holds springs, weights
and what constant forces do when their levers change.

The response is taken at the head, with equivalent masses and stiffness of a mechanism.

A chain of one to three lumped masses is fitted to a measured or computed receptance of a head by
least squares of the logarithm of the receptances' ratio, magnitude and phase at once, so that
resonances and the quiet range between them count alike. Masses, springs and dampers stay positive.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy import linalg
from scipy.optimize import least_squares, minimize_scalar
from scipy.signal import find_peaks

from catenary.base.errors import InputError, RunBroken
from catenary.mbs.head.strips import Strips, Suspension, head_parts
from catenary.mbs.lumped import LumpedData
from catenary.mbs.mechanism.multibody_pantograph import MultibodyData, reduced, stand
from catenary.mbs.rigid.bodies import Motion, Vector, point
from catenary.mbs.rigid.forces import PointForce
from catenary.mbs.rigid.joints import ORIGIN, Constant, PrescribedPoint, unit
from catenary.mbs.rigid.statics import equilibrium, force_on_ways
from catenary.mbs.rigid.system import System, null_space

# Largest displacement [m or rad] and velocity [m/s or rad/s] for differences of forces.
STEP, SPEED = 1e-5, 1e-4
# Motions that less than this part of the largest stiffness, damping and load acts on are left out.
NEUTRAL = 1e-8
# A force left on a free motion above this part of the largest one (or of 1 N): not at rest.
UNBALANCED = 1e-6
# Names of what is added to the mechanism here.
WIRE, HELD = "wire on the head", "arm held for a moment"
MOST_MASSES = 3
# Bounds of masses [kg], stiffnesses [N/m] and dampings [N s/m]. A lower bound stands for "none".
BOUNDS = ((1e-2, 1e3), (1e-3, 1e8), (1e-6, 1e6))
N_STARTS = 24
# No further start is tried below this rms error.
EXACT = 1e-8


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


def chain_model(data: LumpedData) -> LinearModel:
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
    model = with_strips(chain_model(data), data.strips)
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


class ChainFit(NamedTuple):
    """A fitted chain, and how far it is from what it was fitted to.

    ``rms_error`` and ``largest_error``: of |H_fit / H - 1| over the ``n_points`` frequencies from
    ``lowest`` to ``highest`` [Hz].
    """

    data: LumpedData
    rms_error: float
    largest_error: float
    lowest: float
    highest: float
    n_points: int

    def receptance(self, frequencies: Vector) -> np.ndarray:
        """Receptance of the fitted chain at its head (n_f,) [m/N]."""
        return chain_model(self.data).receptance(frequencies)


def fit_chain(frequencies: Vector, receptance: np.ndarray, n_masses: int) -> ChainFit:
    """The chain of ``n_masses`` masses whose head's receptance is nearest to the given one.

    A receptance that is not that of springs to the ground at its low end (a lift that pulls harder
    the higher it gets) cannot be met by positive springs there: fit above such frequencies.

    Parameters
    ----------
    frequencies : array_like, shape (n,)
        Frequencies [Hz], positive.
    receptance : ndarray, shape (n,)
        Complex displacement per force, both upward [m/N].
    n_masses : int
        Number of masses, 1 to 3.

    Raises
    ------
    InputError
        Other than one to three masses, too few points for them, or a receptance of zero.
    RunBroken
        No start leads to a fit.
    """
    at, wanted = np.asarray(frequencies, dtype=float), np.asarray(receptance, dtype=complex)
    if not 1 <= n_masses <= MOST_MASSES:
        raise InputError(f"A chain is fitted of 1 to {MOST_MASSES} masses, not of {n_masses}.")
    if len(at) != len(wanted) or 2 * len(at) < 3 * n_masses:
        raise InputError(
            f"{len(at)} frequencies with {len(wanted)} receptances are too few for the "
            f"{3 * n_masses} values of {n_masses} masses."
        )
    if np.any(at <= 0.0) or not np.isfinite(wanted).all() or np.any(wanted == 0.0):
        raise InputError("A chain is fitted to finite receptances at frequencies above zero.")
    lower, upper = np.log(np.repeat(np.array(BOUNDS), n_masses, axis=0)).T
    omega, best = 2.0 * np.pi * at, None
    for start in _starts(at, wanted, n_masses):
        found = least_squares(
            _residuals,
            np.clip(start, lower + 1e-9, upper - 1e-9),
            jac=_slopes,
            bounds=(lower, upper),
            args=(omega, wanted),
            xtol=1e-15,
            ftol=1e-15,
            gtol=1e-15,
            max_nfev=400,
        )
        if np.isfinite(found.cost) and (best is None or found.cost < best.cost):
            best = found
        if best is not None and np.sqrt(2.0 * best.cost / len(at)) < EXACT:
            break
    if best is None:
        raise RunBroken(f"No chain of {n_masses} masses comes near the receptance.")
    data = _chain(best.x)
    error = np.abs(chain_model(data).receptance(at) / wanted - 1.0)
    return ChainFit(
        data,
        float(np.sqrt(np.mean(error**2))),
        float(error.max()),
        float(at.min()),
        float(at.max()),
        len(at),
    )


def _chain(logarithms: np.ndarray) -> LumpedData:
    """Masses, stiffnesses and dampings from the logarithms (3 n,) of all."""
    masses, stiffnesses, dampings = np.exp(logarithms).reshape(3, -1).tolist()
    return LumpedData(tuple(masses), tuple(stiffnesses), tuple(dampings))


def _residuals(logarithms: np.ndarray, omega: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """log |H / H_wanted| and the difference of phases (2 n,)."""
    ratio = np.log(chain_model(_chain(logarithms)).receptance(omega / (2.0 * np.pi)) / wanted)
    return np.concatenate([ratio.real, ratio.imag])


def _slopes(logarithms: np.ndarray, omega: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Derivatives of the residuals to the logarithms (2 n, 3 n_masses).

    With x the motions under a unit force on the head, dH / dp = -x^T (dZ / dp) x.
    """
    data = _chain(logarithms)
    moved = chain_model(data).amplitudes(omega / (2.0 * np.pi))
    # Stretch of each spring, the last one's to the ground.
    stretched = np.diff(moved, axis=1, append=0.0)
    by_stiffness = -(stretched**2)
    columns = np.hstack(
        [omega[:, None] ** 2 * moved**2, by_stiffness, 1j * omega[:, None] * by_stiffness]
    )
    columns *= np.exp(logarithms) / moved[:, :1]
    return np.vstack([columns.real, columns.imag])


def _starts(at: np.ndarray, wanted: np.ndarray, n_masses: int) -> list[np.ndarray]:
    """Logarithms to start from: the head's mass from the highest frequency, the rest scattered.

    Scattered always the same way, so that a fit can be repeated.
    """
    random = np.random.default_rng(1)
    low, high = BOUNDS[0]
    head = float(np.clip(np.abs(apparent_mass(at[-1:], wanted[-1:]))[0], low, high))
    starts = []
    for _ in range(N_STARTS):
        masses = head * np.exp(random.uniform(np.log(0.3), np.log(6.0), n_masses))
        masses[0] = head
        # Springs that make their masses swing within the range.
        swings = np.exp(random.uniform(np.log(at[0]), np.log(at[-1]), n_masses))
        stiffnesses = masses * (2.0 * np.pi * swings) ** 2
        ratios = np.exp(random.uniform(np.log(0.01), np.log(0.5), n_masses))
        dampings = 2.0 * ratios * np.sqrt(masses * stiffnesses)
        starts.append(np.log(np.concatenate([masses, stiffnesses, dampings])))
    return starts
