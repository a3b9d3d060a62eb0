"""Newmark's energy balance of a line.

The method has a balance of its own (S. Krenk, Comput. Methods Appl. Mech. Engrg. 195 (2006)
6110-6124), in which numerical damping only takes.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.sparse import csr_matrix

from catenary.solver.integrators.line_loads import LineLoads
from catenary.solver.linear.halo import Subdomain
from catenary.solver.model.link_directions import swings_of_droppers
from catenary.solver.model.links import Direction
from catenary.solver.model.loads import MemoryLoad
from catenary.solver.model.matrices import whole_matrix
from catenary.solver.model.model import Model
from catenary.solver.problem.contact_laws import KinematicLaw
from catenary.solver.problem.problem import Problem


class LineBalance:
    """Newmark's energy balance of the line, and what one switch of a dropper adds to it.

    With step h, d = beta - gamma / 2 and the line's M, C and K, each step changes

        v.Mv / 2 + u.Ku / 2 + h^2 d a.Ma / 2 + h (gamma - 1/2) (v.Cv + h^2 d a.Ca) / 2

    by the work (u_n+1 - u_n) . ((1 - gamma) f_n + gamma f_n+1) of the loads f, less

        (gamma - 1/2) (Du.K Du + h^2 d Da.M Da) + h w.C w + h^3 d ((gamma - 1/2)^2 - d / 4) Da.C Da

    where D is the change in the step and w = (v_n + v_n+1) / 2 + h d Da / 2. None of it is negative
    if gamma >= 1/2 and 0 <= d <= 4 (gamma - 1/2)^2. The terms beyond the energy are
    `damping_terms`; average acceleration has none. A slack dropper has no part in C.

    **A dropper that slackens** from its tension k a to a gap b, a + b being its change of length
    in the step, stored k a^2 / 2 and does the work (1 - gamma) k a (a + b). With a + b = h e' that
    makes at most (1 - gamma)^2 k (h e')^2 / 2; one that tightens makes nothing. The same holds for
    an uplift stop that opens or closes.

    **The transverse stiffness of a dropper**, N / l, vanishes when it slackens: its energy
    (N / l) q^2 / 2 comes and goes at once. The balance treats the missing force as a load on a line
    that keeps this stiffness: `across`.

    Integrators other than Newmark's are balanced like average acceleration. After incidents the
    terms are those of the line as it was.

    Parameters
    ----------
    tension : (n_droppers,) forces of droppers at rest [N]
    """

    def __init__(self, model: Model, problem: Problem, tension: np.ndarray) -> None:
        numerics = problem.numerics
        newmark = numerics.integrator == "newmark"
        dt, gamma = numerics.dt, numerics.gamma if newmark else 0.5
        excess = numerics.beta - 0.5 * gamma if newmark else 0.0
        self.weights = (1.0 - gamma, gamma)
        # Recorded forces of a kinematic contact are means by these weights already.
        self.recorded_means = isinstance(problem.contact, KinematicLaw)
        self._terms: list[tuple[str, csr_matrix]] = []
        if gamma != 0.5 or excess != 0.0:
            damping = whole_matrix(model, damping=0.5 * dt * (gamma - 0.5))
            of_acceleration = whole_matrix(model, mass=0.5) + damping
            self._terms = [
                ("velocity", damping),
                ("acceleration", dt**2 * excess * of_acceleration),
            ]
        self._ends = model.dofs(model.mesh.droppers)
        released = (1.0 - model.simulated.kept_ratio) * model.released_damping
        of_velocity = 0.5 * dt * (gamma - 0.5) * released
        self._slack = [
            ("velocity", of_velocity),
            ("acceleration", dt**2 * excess * of_velocity),
        ]
        # Gusts do work as contacts do. What a line beyond an end does is a part of the line.
        whole = Subdomain(*(0, model.n_dofs) * 3)
        outer = [load for load in model.loads if not isinstance(load, MemoryLoad)]
        self._loads = LineLoads(outer, whole, model.constrained) if outer else None
        steepest = model.dropper_slopes.slope.max(axis=1, initial=0.0)
        self._share = 0.5 * steepest * ((1.0 - gamma) * dt) ** 2
        self._along = model.droppers.direction
        self._rest = model.dropper_slopes.stretch_under(tension)
        hangs = (model.dropper_gap <= 0.0) & ~model.broken
        alpha = np.divide(
            model.released_damping, model.dropper_stiffness, where=hangs, out=np.zeros(hangs.size)
        )
        share = np.where(hangs, 1.0 - model.simulated.kept_ratio, 0.0)
        if problem.incidents:  # one that breaks carries nothing either, but is no part of the line
            share = np.zeros(hangs.size)
        self._swings = [
            (direction, share * pull, alpha) for direction, pull in swings_of_droppers(model)
        ]
        self._arms = model.dofs(model.mesh.steady_arms)
        stops = [arms.kind.stop_stiffness for arms in problem.line.steady_arms]
        self._stop_share = 0.5 * max(stops, default=0.0) * ((1.0 - gamma) * dt) ** 2

    def damping_terms(self, states: Mapping[str, np.ndarray], taut: np.ndarray) -> np.ndarray:
        """Term of numerical damping in the energy of states (k, n_dofs) each [J], shape (k,).

        ``taut`` (k, n_droppers) are the droppers that carry anything.
        """
        found = np.zeros(taut.shape[0])
        for of, matrix in self._terms:
            found += np.einsum("ij,ij->i", states[of], (matrix @ states[of].T).T)
        for of, factors in self._slack:
            found -= np.where(taut, 0.0, self._between(states[of]) ** 2) @ factors
        return found

    def work_of_loads(self, times: np.ndarray, moved: np.ndarray) -> np.ndarray:
        """Work of loads in time [J] in steps to the later of ``times`` (k,) [s] that changed the
        displacement by ``moved`` (k - 1, n_dofs), shape (k - 1,)."""
        if self._loads is None:
            return np.zeros(len(moved))
        forces = np.empty((times.size, moved.shape[1]))
        for force, time in zip(forces, times, strict=True):
            self._loads.at(time)
            force[:] = self._loads.values
        before, after = self.weights
        means = before * forces[:-1] + after * forces[1:]
        return np.asarray(np.einsum("ij,ij->i", means, moved))

    def across(
        self, states: Mapping[str, np.ndarray], taut: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Energy that states (k, n_dofs) each lack [J], (k,), as slack droppers have no stiffness
        across them, and work of the missing forces in the steps between [J], (k - 1,)."""
        moved, speed = states["displacement"], states["velocity"]
        lacks, work = np.zeros(len(moved)), np.zeros(len(moved) - 1)
        # Stored energy knows of no dampers.
        loose = self._rest + _stretch(self._along, moved) < 0.0
        before, after = self.weights
        for direction, pull, alpha in self._swings:
            across = _stretch(direction, moved)
            lacks += np.where(loose, across**2, 0.0) @ (0.5 * pull)
            force = np.where(taut, 0.0, pull * (across + alpha * _stretch(direction, speed)))
            means = before * force[:-1] + after * force[1:]
            work += (means * np.diff(across, axis=0)).sum(axis=1)
        return lacks, work

    def one_switch(self, velocity: np.ndarray, switched: np.ndarray) -> float:
        """The most that one dropper makes [J] at velocities (k, n_dofs) after the steps in which
        those ``switched`` (k, n_droppers) slackened or tightened."""
        made = self._share * self._between(velocity) ** 2
        return float(made[switched].max(initial=0.0))

    def one_stop(self, velocity: np.ndarray, switched: np.ndarray) -> float:
        """The same of uplift stops, ``switched`` (k, n_arms), or (k, 0) without them."""
        if not switched.shape[1]:
            return 0.0
        made = self._stop_share * velocity[:, self._arms] ** 2
        return float(made[switched].max(initial=0.0))

    def _between(self, values: np.ndarray) -> np.ndarray:
        """Upper less lower end of each dropper, (k, n) of (k, n_dofs)."""
        upper, lower = self._ends.T
        return np.asarray(values[:, upper] - values[:, lower])


def _stretch(direction: Direction, values: np.ndarray) -> np.ndarray:
    """Stretch of n links under values (k, n_dofs), (k, n)."""
    unknowns, weights = direction
    return np.asarray((values[:, unknowns] * weights).sum(axis=2))
