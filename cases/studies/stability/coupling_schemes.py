"""Stability of the coupling schemes, from the matrices of a step and by marching.

A head touches each contact wire that runs over its place. The line is reduced to what forces there
can move: Lanczos's method on M^-1 K from M^-1 b, b being the loads of unit forces, one after the
other (a band of them: A. Ruhe, Math. Comp. 33 (1979) 680-687). What it leaves out is moved only
later, by way of what is in (a step of n vectors is exact to 2 n moments; B. N. Parlett, The
Symmetric Eigenvalue Problem, chapter 13). With proportional damping the reduced C is exact too.

With d = (line, masses of the pantograph) and columns r so that depths of contacts are r^T d, a step
of Newmark's method is

    A a = -C v* - K d* - k_i r r^T d - k_e r r^T d*,        A = M + gamma dt C + beta dt^2 K

with predictions d*, v* and the contact stiffness k as k_i (implicit) or k_e (explicit). Exchanges
of forces and motions, by ``iterated`` or the fixed-point correction, multiply errors of the forces
by k beta dt^2 r^T A^-1 r. Under HHT and generalized alpha the line's steps are those of Newmark's
method for b = M^-1 (f - C v - K d) with a = p + q b, p known before (`docs/theory`,
generalized_alpha.md): q beta and q gamma stand in A, and p in the predictions. Pantographs step by
average acceleration then.

By marching the program itself shows whether it lets a perturbation grow. A pantograph without
static force is pressed into the wire at rest by a little, and let go. Without loss of contact and
slack droppers all is linear, so that the size of the start does not matter.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from scipy import linalg, optimize
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import splu

from catenary.cases.studies.hard.runs import rest_height
from catenary.mbs.lumped import LumpedData
from catenary.solver.contact.contact_wire import ContactWires
from catenary.solver.model.matrices import whole_matrix
from catenary.solver.model.model import Model
from catenary.solver.problem.contact_laws import LinearLaw
from catenary.solver.problem.integrator_parameters import Integration, integration_of
from catenary.solver.problem.problem import Numerics, Problem
from catenary.solver.statics.line_at_rest import LineAtRest
from catenary.solver.time_loop.march import March
from catenary.solver.time_loop.views.observers import NEVER, Observer, StepView

# Vectors of Lanczos's method. What decides is within a few elements of the contact.
N_VECTORS = 40
# Radii up to this are stable: eigenvalues of a mass that nothing holds are 1 twice, with a block
# of Jordan's, whose eigenvalues are only found to the root of round-off.
STABLE = 1.0 + 1e-6
# A head meets wires together whose heights differ by no more [m], some times the depth of a march.
_AS_HIGH = 5e-3
# Depth at the start [m]: exchanges settle to a share of it that is more than the round-off of
# heights of 5 m, 1e-15 m.
DEPTH = 1e-3
# Slow enough to stand: within a run the train moves less than a millimetre [m/s].
_SPEED = 1e-4
# A perturbation grows if the force passes this many times the first one within so many steps.
GROWN, STEPS = 1e3, 400
# Exchanges must agree to this share of the start within so many; one after the other, few steps
# tell as much as many.
AGREED, EXCHANGES, EXCHANGED_STEPS = 1e-9, 1000, 20
COUPLINGS = ("implicit", "explicit", "iterated", "fixed_point")


@dataclass(frozen=True)
class PointModel:
    """The line reduced to one place, where c contact wires run.

    ``stiffness`` and ``damping`` (n, n) for a mass matrix of ones; ``load`` (n, c) of a unit force
    on each wire, and heights there of unit displacements [1/sqrt(kg)].
    """

    stiffness: np.ndarray
    damping: np.ndarray
    load: np.ndarray

    @property
    def mass(self) -> float:
        """Least apparent mass of the wires under sudden forces there [kg]: of one wire
        1 / (b . M^-1 b)."""
        return 1.0 / _largest(self.load.T @ self.load)


class Methods(NamedTuple):
    """How the ``line`` and the ``pantograph`` step."""

    line: Integration
    pantograph: Integration


def methods_of(numerics: Numerics) -> Methods:
    """The methods of a run."""
    name, beta, gamma = numerics.integrator, numerics.beta, numerics.gamma
    line = integration_of(name, numerics.spectral_radius, beta, gamma)
    return Methods(line, Integration(beta, gamma))


@dataclass(frozen=True)
class Coupled:
    """Line and pantograph on two sides of c contacts, and the ``methods`` by which they step.

    ``mass``, ``stiffness``, ``damping`` (n, n) of both, the first ``n_line`` unknowns being the
    line's; ``depth`` (n, c) the contacts' depths for unit displacements.
    """

    mass: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray
    depth: np.ndarray
    n_line: int
    methods: Methods

    @cached_property
    def _by_unknown(self) -> np.ndarray:
        """Newmark's beta and gamma of each unknown, and q, of_a and of_b, (5, n, 1).

        a = q b + p, where p is made with of_a and of_b from the step before.
        """
        n = [self.n_line, len(self.depth) - self.n_line]
        both = zip(*self.methods, strict=True)
        beta, gamma, a_m, a_f = (np.repeat(pair, n)[:, None] for pair in both)
        parts = (1.0 - a_f, -a_m, a_f)
        return np.stack([beta, gamma, *(part / (1.0 - a_m) for part in parts)])

    def step_matrix(self, dt: float, implicit: float, explicit: float) -> np.ndarray:
        """Matrix of a step of ``dt`` [s] for (d, dt v, dt^2 a), and under HHT and generalized alpha
        dt^2 b; shape (3 n, 3 n) or (4 n, 4 n).

        ``implicit`` and ``explicit`` are the parts of the contact's stiffness [N/m] that act at the
        end of the step and at the prediction.
        """
        beta, gamma, share, of_a, of_b = self._by_unknown
        n = len(self.depth)
        one, none, spring = np.eye(n), np.zeros((n, n)), self.depth @ self.depth.T
        stiffness = self.stiffness + implicit * spring
        before = np.hstack([none, none, of_a * one, of_b * one])
        place = np.hstack([one, one, (0.5 - beta) * one, none]) + beta * before
        speed = np.hstack([none, one, (1.0 - gamma) * one, none]) + gamma * before
        force = dt**2 * (stiffness + explicit * spring) @ place + dt * self.damping @ speed
        found = -linalg.solve(self._operator(dt, stiffness), force)
        moved = share * found
        rows = [place + beta * moved, speed + gamma * moved, before + moved, found]
        weighted = any(self.methods.line[2:])
        return np.vstack(rows) if weighted else np.vstack(rows[:3])[:, : 3 * n]

    def _operator(self, dt: float, stiffness: np.ndarray) -> np.ndarray:
        """A, (n, n), with the ``stiffness`` of both; each column by the method of its unknown."""
        beta, gamma, share, *_ = self._by_unknown
        by_speed, by_place = share * gamma * dt, share * beta * dt**2
        return np.asarray(self.mass + by_speed.T * self.damping + by_place.T * stiffness)

    def radius(self, dt: float, stiffness: float, coupling: str) -> float:
        """Spectral radius of a step of ``dt`` [s] with the "implicit" or "explicit" ``coupling`` by
        a contact of ``stiffness`` [N/m]."""
        parts = (stiffness, 0.0) if coupling == "implicit" else (0.0, stiffness)
        return float(np.abs(linalg.eigvals(self.step_matrix(dt, *parts))).max())

    def exchange_ratio(self, dt: float, stiffness: float) -> float:
        """Largest factor by which an exchange of forces and motions in a step of ``dt`` [s]
        multiplies errors of the forces, on a contact of ``stiffness`` [N/m]."""
        beta, _, share, *_ = self._by_unknown
        answer = linalg.solve(self._operator(dt, self.stiffness), self.depth)
        return stiffness * _largest(self.depth.T @ (share * beta * dt**2 * answer))

    def largest_step(
        self, stiffness: float, coupling: str, steps: tuple[float, float], allowed: float = 1.0
    ) -> float:
        """Largest step [s] of a coupling out of a range, inf if all are stable and 0 if none is.

        Parameters
        ----------
        stiffness : of the contact [N/m]
        coupling : "implicit", "explicit", or any other, which exchanges
        steps : least and greatest [s]
        allowed : largest factor by which a step or an exchange may multiply errors
        """

        def excess(log_dt: float) -> float:
            dt = float(np.exp(log_dt))
            if coupling in ("implicit", "explicit"):
                return self.radius(dt, stiffness, coupling) - max(allowed, STABLE)
            return self.exchange_ratio(dt, stiffness) - allowed

        low, high = np.log(steps)
        if excess(low) > 0:
            return 0.0
        if excess(high) <= 0:
            return np.inf
        return float(np.exp(optimize.bisect(excess, low, high, xtol=1e-5)))


def matrices(model: Model) -> tuple[csc_matrix, csc_matrix, csc_matrix]:
    """M, K and C of the line on its free unknowns, held ones with ones in M. Not collective."""
    return (
        whole_matrix(model, mass=1.0, held_diagonal=1.0),
        whole_matrix(model, stiffness=1.0),
        whole_matrix(model, damping=1.0),
    )


def loads_at(wires: ContactWires, x: float, n_dofs: int) -> np.ndarray:
    """Loads of unit forces on the c contact wires that run at ``x`` [m], shape (n_dofs, c)."""
    touches = wires.touches(np.full(wires.n_wires, x), np.arange(wires.n_wires))
    touches = touches[touches["present"] > 0.0]
    loads = np.zeros((n_dofs, touches.size))
    for load, touch in zip(loads.T, touches, strict=True):
        dofs = wires.dofs[touch["element"] + np.array([0, 1])].ravel()
        load[dofs] = touch["whole_value"]
    return loads


def lightest_place(
    model: Model, wires: ContactWires, low: float, high: float, every: bool = False
) -> float | None:
    """Place in [low, high] [m] where the apparent mass of the contact wires is least.

    Ends of elements and eight places in between are tried, of those where a head meets the most
    wires; None where wires are too far apart in height for that, or if ``every`` one is wanted and
    nowhere met. Not collective.
    """
    mass = splu(matrices(model)[0])
    share = np.arange(9) / 8.0
    found = [np.zeros(0)]
    for number in range(wires.n_wires):
        first, last = wires.nodes_between(low, high, number)
        x = wires.x[first:last]
        found += [a + share * (b - a) for a, b in zip(x, x[1:], strict=False)]
    places = np.unique(np.concatenate(found))
    places = places[(places >= low) & (places <= high)]
    heights = np.array([wires.rest_height_of(wire, places) for wire in range(wires.n_wires)])
    there = np.isfinite(heights)
    spread = np.where(there, heights, -np.inf).max(0) - np.where(there, heights, np.inf).min(0)
    met = np.where(spread <= _AS_HIGH, there.sum(axis=0), 0)
    most = met.max(initial=0)
    if most == 0 or (every and most < wires.n_wires):
        return None
    places = places[met == most]

    def softness(place: float) -> float:
        loads = loads_at(wires, place, model.n_dofs)
        return _largest(loads.T @ mass.solve(loads))

    return float(max(places, key=softness))


def _largest(symmetric: np.ndarray) -> float:
    """The largest eigenvalue."""
    return float(linalg.eigvalsh(symmetric)[-1])


def point_model(model: Model, loads: np.ndarray, n_vectors: int = N_VECTORS) -> PointModel:
    """The line reduced to forces with ``loads`` (n_dofs, c), by ``n_vectors`` for each. Not
    collective."""
    mass, stiffness, damping = matrices(model)
    factor = splu(mass)
    most = n_vectors * loads.shape[1]
    basis, n = np.zeros((model.n_dofs, most)), 0
    # The motion by the loads themselves, then that by each of those vectors.
    next_ones = [factor.solve(load) for load in loads.T]
    done = 0
    while n < most and (next_ones or done < n):
        if next_ones:
            vector = next_ones.pop(0)
        else:
            vector, done = factor.solve(stiffness @ basis[:, done]), done + 1
        size = float(np.sqrt(vector @ (mass @ vector)))
        for _ in range(2):  # once loses digits
            vector = vector - basis[:, :n] @ (basis[:, :n].T @ (mass @ vector))
        left = float(np.sqrt(vector @ (mass @ vector)))
        if left < 1e-10 * size:  # it moves no more than what is there
            continue
        basis[:, n] = vector / left
        n += 1
    basis = basis[:, :n]
    return PointModel(basis.T @ (stiffness @ basis), basis.T @ (damping @ basis), basis.T @ loads)


def couple(line: PointModel, data: LumpedData, methods: Methods) -> Coupled:
    """Line and chain of masses, without the springs of the contacts; both step by ``methods``."""
    head = np.zeros((data.n_masses, line.load.shape[1]))
    head[0] = 1.0
    return Coupled(
        linalg.block_diag(np.eye(len(line.load)), np.diag(data.masses)),
        linalg.block_diag(line.stiffness, data.chain(data.stiffnesses)),
        linalg.block_diag(line.damping, data.chain(data.dampings)),
        np.concatenate([-line.load, head]),
        len(line.load),
        methods,
    )


def closed_form(line: PointModel, head_mass: float, stiffness: float) -> float:
    """Step [s] at which omega dt = 2: of one wire omega^2 = k (1 / m_head + 1 / m_wire).

    For average acceleration; m_head is ``head_mass`` [kg], k the ``stiffness`` of the contact
    [N/m].

    At the limit of the explicit coupling the motion changes its sign from step to step; a = (-1)^n
    a_0 then leaves d = v = 0 at the ends of steps, so that neither springs nor dampers act, and
    only masses resist: a = M^-1 r f, r . d* = dt^2 / 4 r . a. For exchanges it is the limit where
    springs and dampers within the step do not count, A = M.
    """
    return float(2.0 / np.sqrt(stiffness * _largest(line.load.T @ line.load + 1.0 / head_mass)))


@dataclass(frozen=True)
class Bench:
    """A line at rest, and the place on it where heads are tried.

    ``rest`` is of a scene without loss of contact and slack droppers, whose leading pantograph is
    ``data``; ``x`` [m]. Lives on one process: ``comm`` is its own.
    """

    rest: LineAtRest
    data: LumpedData
    x: float
    comm: Any

    def with_head(self, mass: float) -> LumpedData:
        """The pantograph with a head of ``mass`` [kg]."""
        data = self.data
        return LumpedData((mass, *data.masses[1:]), data.stiffnesses, data.dampings)

    def problem(self, coupling: str, stiffness: float, head_mass: float, dt: float) -> Problem:
        """A head of ``head_mass`` [kg] on a contact of ``stiffness`` [N/m], for as many steps of
        ``dt`` [s] as show whether the ``coupling`` is stable."""
        usual = self.rest.problem
        height = float(rest_height(self.rest, np.array([self.x]))[0])
        # At its nominal height no spring is strained: nothing but the perturbation moves.
        placement = replace(
            usual.train.placements[0], data=self.with_head(head_mass), static_force=0.0, behind=0.0,
            nominal_height=height,
        )  # fmt: skip
        n_steps = STEPS if coupling in ("implicit", "explicit") else EXCHANGED_STEPS
        train = replace(
            usual.train,
            speed=_SPEED,
            start=self.x,
            end=self.x + (n_steps + 0.5) * dt * _SPEED,
            raise_time=0.0,
            placements=(placement,),
            start_below=-DEPTH,
            vehicle=None,
        )
        eps_d, line = AGREED * DEPTH, methods_of(usual.numerics).line
        numerics = replace(
            usual.numerics,
            dt=dt,
            scheme="fixed_point" if coupling == "fixed_point" else "one_solve",
            coupling="implicit" if coupling == "fixed_point" else coupling,
            eps_force=AGREED * DEPTH * stiffness,
            eps_d=eps_d,
            eps_v=eps_d * line.gamma / (line.beta * dt),
            max_iterations=EXCHANGES,
        )
        return replace(
            usual, train=train, numerics=numerics, contact=LinearLaw(stiffness, damping=0.0)
        )

    def is_stable(self, coupling: str, stiffness: float, head_mass: float, dt: float) -> bool:
        """Whether the program's own steps of ``dt`` [s] with a ``coupling`` keep a perturbation
        small, of a head of ``head_mass`` [kg] on a contact of ``stiffness`` [N/m]."""
        problem = self.problem(coupling, stiffness, head_mass, dt)
        watched = _Growth(GROWN * stiffness * DEPTH)
        rest = self.rest
        with March(self.comm, problem, rest.model, rest.form, rest.lift) as march:
            ended = march.run([watched], lambda: watched.grown)
        return ended.outcome == "done" and not watched.grown

    def bracket(
        self, coupling: str, stiffness: float, head_mass: float, steps: tuple[float, float],
        resolution: float,
    ) -> tuple[float, float]:  # fmt: skip
        """A step [s] found stable and one found unstable, by bisection between two ``steps``.

        ``coupling``, ``stiffness`` and ``head_mass`` are as of ``is_stable``. The two differ by the
        factor 1 + ``resolution`` at most; (longest, inf) if all are stable, (0, shortest) if none
        is.
        """
        low, high = steps
        if self.is_stable(coupling, stiffness, head_mass, high):
            return high, np.inf
        if not self.is_stable(coupling, stiffness, head_mass, low):
            return 0.0, low
        while high > (1.0 + resolution) * low:
            middle = float(np.sqrt(low * high))
            is_stable = self.is_stable(coupling, stiffness, head_mass, middle)
            low, high = (middle, high) if is_stable else (low, middle)
        return low, high


class _Growth(Observer):
    """Observer that checks whether a contact force has passed a bound [N]."""

    def __init__(self, bound: float) -> None:
        self._bound = bound
        self.grown = False

    def next_state(self, step: int) -> int:
        """Rows are enough."""
        return NEVER

    def observe(self, view: StepView) -> None:
        """Not collective."""
        largest = float(np.abs(view.each("contact_force")).max())
        self.grown = self.grown or not largest < self._bound
