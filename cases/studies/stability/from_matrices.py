"""Stability of the coupling schemes from the matrices of a step: line, head and penalty contact.

The line is reduced to what a force on one point of the contact wire can move: Lanczos's method
on M^-1 K from M^-1 b, b being the load of a unit force there. What it leaves out is moved only
later, by way of what is in (a step of n vectors is exact to 2 n moments; B. N. Parlett, The
Symmetric Eigenvalue Problem, chapter 13). With proportional damping the reduced C is exact too.

With d = (line, masses of the pantograph) and r so that the contact's depth is r . d, a step of
Newmark's method is

    A a = -C v* - K d* - k_i r (r . d) - k_e r (r . d*),        A = M + gamma dt C + beta dt^2 K

with predictions d*, v* and the contact stiffness k as k_i (implicit) or k_e (explicit). Exchanges
of forces and motions, by ``iterated`` or the fixed-point correction, multiply an error of the
force by k beta dt^2 r . A^-1 r.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import linalg, optimize
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import splu

from catenary.mbs.lumped_data import LumpedData
from catenary.solver.contact.contact_wire import ContactWires
from catenary.solver.model.matrices import whole_matrix
from catenary.solver.model.model import Model

# Vectors of Lanczos's method. What decides is within a few elements of the contact.
N_VECTORS = 40
# Radii up to this are stable: eigenvalues of a mass that nothing holds are 1 twice, with a block
# of Jordan's, whose eigenvalues are only found to the root of round-off.
STABLE = 1.0 + 1e-6


@dataclass(frozen=True)
class PointModel:
    """The line reduced to one point of the contact wire.

    ``stiffness`` and ``damping`` (n, n) for a mass matrix of ones; ``load`` (n,) of a unit force,
    and height there of unit displacements [1/sqrt(kg)].
    """

    stiffness: np.ndarray
    damping: np.ndarray
    load: np.ndarray

    @property
    def mass(self) -> float:
        """What a force at the point meets before anything else has moved [kg]: 1 / b . M^-1 b."""
        return float(1.0 / (self.load @ self.load))


@dataclass(frozen=True)
class Step:
    """Newmark's step: ``dt`` [s], ``beta``, ``gamma``."""

    dt: float
    beta: float
    gamma: float


@dataclass(frozen=True)
class Coupled:
    """Line and pantograph on two sides of a contact.

    ``mass``, ``stiffness``, ``damping`` (n, n) of both; ``depth`` (n,) the contact's depth for
    unit displacements.
    """

    mass: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray
    depth: np.ndarray


def matrices(model: Model) -> tuple[csc_matrix, csc_matrix, csc_matrix]:
    """M, K and C of the line on its free unknowns, held ones with ones in M. Not collective."""
    return (
        whole_matrix(model, mass=1.0, held_diagonal=1.0),
        whole_matrix(model, stiffness=1.0),
        whole_matrix(model, damping=1.0),
    )


def load_at(wire: ContactWires, x: float, n_dofs: int) -> np.ndarray:
    """Load of a unit force on the contact wire at ``x`` [m], shape (n_dofs,)."""
    touch = wire.touches(np.array([x]))[0]
    dofs = wire.dofs[touch["element"] + np.array([0, 1])].ravel()
    load = np.zeros(n_dofs)
    load[dofs] = touch["whole_value"]
    return load


def lightest_place(model: Model, wire: ContactWires, low: float, high: float) -> float:
    """Where in [low, high] [m] the contact wire meets a force with the least mass.

    An element's ends and eight places in between are tried. Not collective.
    """
    mass = splu(matrices(model)[0])
    first, last = wire.nodes_between(low, high)
    x = wire.x[first:last]
    share = np.arange(9) / 8.0
    places = np.unique(
        np.concatenate([a + share * (b - a) for a, b in zip(x, x[1:], strict=False)])
    )
    places = places[(places >= low) & (places <= high)]

    def softness(place: float) -> float:
        load = load_at(wire, place, model.n_dofs)
        return float(load @ mass.solve(load))

    return float(max(places, key=softness))


def point_model(model: Model, load: np.ndarray, n_vectors: int = N_VECTORS) -> PointModel:
    """The line reduced to a force with this ``load`` (n_dofs,). Not collective."""
    mass, stiffness, damping = matrices(model)
    factor = splu(mass)
    start = factor.solve(load)
    norm = float(np.sqrt(start @ load))
    basis = np.zeros((model.n_dofs, n_vectors))
    vector, n = start / norm, 0
    while True:
        basis[:, n] = vector
        n += 1
        if n == n_vectors:
            break
        vector = factor.solve(stiffness @ vector)
        size = float(np.sqrt(vector @ (mass @ vector)))
        for _ in range(2):  # once loses digits
            vector = vector - basis[:, :n] @ (basis[:, :n].T @ (mass @ vector))
        left = float(np.sqrt(vector @ (mass @ vector)))
        if left < 1e-10 * size:  # the force can move no more than this
            break
        vector = vector / left
    basis = basis[:, :n]
    unit = np.zeros(n)
    unit[0] = norm
    return PointModel(basis.T @ (stiffness @ basis), basis.T @ (damping @ basis), unit)


def couple(line: PointModel, data: LumpedData) -> Coupled:
    """Line and chain of masses, without the spring of the contact."""
    return Coupled(
        linalg.block_diag(np.eye(line.load.size), np.diag(data.masses)),
        linalg.block_diag(line.stiffness, data.chain(data.stiffnesses)),
        linalg.block_diag(line.damping, data.chain(data.dampings)),
        np.concatenate([-line.load, [1.0], np.zeros(data.n_masses - 1)]),
    )


def step_matrix(both: Coupled, step: Step, implicit: float, explicit: float) -> np.ndarray:
    """Matrix of a step for (d, dt v, dt^2 a), shape (3 n, 3 n).

    ``implicit`` and ``explicit`` are the parts of the contact's stiffness [N/m] that act at the
    end of the step and at the prediction.
    """
    n, dt, beta, gamma = both.depth.size, step.dt, step.beta, step.gamma
    one, none = np.eye(n), np.zeros((n, n))
    spring = np.outer(both.depth, both.depth)
    stiffness = both.stiffness + implicit * spring
    operator = both.mass + gamma * dt * both.damping + beta * dt**2 * stiffness
    place = np.hstack([one, one, (0.5 - beta) * one])
    speed = np.hstack([none, one, (1.0 - gamma) * one])
    force = dt**2 * (stiffness + explicit * spring) @ place + dt * both.damping @ speed
    found = -linalg.solve(operator, force, assume_a="sym")
    return np.vstack([place + beta * found, speed + gamma * found, found])


def radius(both: Coupled, step: Step, stiffness: float, coupling: str) -> float:
    """What a step multiplies a perturbation by, at most, with ``implicit`` or ``explicit``."""
    parts = (stiffness, 0.0) if coupling == "implicit" else (0.0, stiffness)
    return float(np.abs(linalg.eigvals(step_matrix(both, step, *parts))).max())


def exchange_ratio(both: Coupled, step: Step, stiffness: float) -> float:
    """What an exchange of forces and motions multiplies an error of the force by."""
    operator = both.mass + step.gamma * step.dt * both.damping
    operator = operator + step.beta * step.dt**2 * both.stiffness
    answer = linalg.solve(operator, both.depth, assume_a="sym")
    return float(stiffness * step.beta * step.dt**2 * (both.depth @ answer))


def largest_step(
    both: Coupled,
    newmark: tuple[float, float],
    stiffness: float,
    coupling: str,
    steps: tuple[float, float],
    allowed: float = 1.0,
) -> float:
    """Largest step [s] of a coupling out of a range, inf if all are stable and 0 if none is.

    Parameters
    ----------
    newmark : beta and gamma
    coupling : "implicit", "explicit", or any other, which exchanges
    steps : least and greatest [s]
    allowed : what a step or an exchange may multiply errors by
    """

    def excess(log_dt: float) -> float:
        step = Step(float(np.exp(log_dt)), *newmark)
        if coupling in ("implicit", "explicit"):
            return radius(both, step, stiffness, coupling) - max(allowed, STABLE)
        return exchange_ratio(both, step, stiffness) - allowed

    low, high = np.log(steps)
    if excess(low) > 0:
        return 0.0
    if excess(high) <= 0:
        return np.inf
    return float(np.exp(optimize.bisect(excess, low, high, xtol=1e-5)))


def closed_form(line: PointModel, head_mass: float, stiffness: float) -> float:
    """Step [s] at which omega dt = 2, omega^2 = k (1 / m_head + 1 / m_wire).

    For average acceleration. At the limit of the explicit coupling the motion changes its sign
    from step to step; a = (-1)^n a_0 then leaves d = v = 0 at the ends of steps, so that neither
    springs nor dampers act, and only masses resist: a = M^-1 r f, r . d* = dt^2 / 4 r . a. For
    exchanges it is the limit where springs and dampers within the step do not count, A = M.
    """
    return float(2.0 / np.sqrt(stiffness * (1.0 / head_mass + 1.0 / line.mass)))
