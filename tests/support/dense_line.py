"""A small line with its train as dense matrices, stepped with every set of slack droppers tried.

Written from the equations with NumPy alone: elements by Gauss quadrature, Newmark's formulas on all
unknowns at once, and the set of slack droppers and of contact found by trying sets until one fits
its own signs. Of the solver it takes places, heights and dropper forces at rest.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import combinations

import numpy as np
from numpy.polynomial import Polynomial

from catenary.mbs.lumped_data import LumpedData
from catenary.meshgen.mesh import CONTACT_WIRE, MESSENGER_WIRE, LineMesh
from catenary.solver.problem.problem import Problem
from catenary.solver.statics.equilibrium import Equilibrium

_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(6)


def hermite(length: float) -> list[Polynomial]:
    """The four cubic shape functions over an element's own coordinate, from 0 to its length."""
    s, h = Polynomial([0.0, 1.0]) / length, length
    return [
        1 - 3 * s**2 + 2 * s**3,
        h * (s - 2 * s**2 + s**3),
        3 * s**2 - 2 * s**3,
        h * (s**3 - s**2),
    ]


@dataclass
class DenseLine:
    """Contact wire, messenger wire and one lumped pantograph of two masses.

    Unknowns are w and dw/dx of each mesh node by its number, then the masses' heights, head first.
    ``dampers_act`` tells whether a slack dropper keeps its damper, ``share`` what it keeps besides.
    """

    problem: Problem
    mesh: LineMesh
    form: Equilibrium
    dampers_act: bool
    share: float = 0.0
    tried: int = 0
    acting: frozenset[int] = frozenset()
    state: np.ndarray = field(default_factory=lambda: np.zeros(0))

    def __post_init__(self) -> None:
        line, mesh = self.problem.line, self.mesh
        n = 2 * mesh.n_nodes
        self.size = n + 2
        mass, stiffness = np.zeros((2, self.size, self.size))
        for wire in (CONTACT_WIRE, MESSENGER_WIRE):
            data, nodes = line.wire(wire), mesh.wires[wire]
            for left, right in zip(nodes[:-1], nodes[1:], strict=True):
                length = mesh.points[right, 0] - mesh.points[left, 0]
                place = 0.5 * length * (1.0 + _POINTS)
                own = np.ix_(*2 * [[2 * left, 2 * left + 1, 2 * right, 2 * right + 1]])
                shape = np.array([f(place) for f in hermite(length)])
                slope = np.array([f.deriv()(place) for f in hermite(length)])
                bend = np.array([f.deriv(2)(place) for f in hermite(length)])
                weights = 0.5 * length * _WEIGHTS
                mass[own] += data.mass_per_length * (shape * weights) @ shape.T
                stiffness[own] += data.tension * (slope * weights) @ slope.T
                stiffness[own] += data.bending_stiffness * (bend * weights) @ bend.T
        self.pull = np.zeros((len(mesh.droppers), self.size))
        for row, (upper, lower) in zip(self.pull, mesh.droppers, strict=True):
            row[2 * upper], row[2 * lower] = 1.0, -1.0
        (droppers,), (supports,), (arms,) = line.droppers, line.supports, line.steady_arms
        assert droppers.kind.stiffness is not None
        self.k = droppers.kind.stiffness
        stiffness += self.k * self.pull.T @ self.pull
        for nodes, value in (
            (mesh.supports, supports.stiffness),
            (mesh.steady_arms, arms.kind.stiffness),
        ):
            stiffness[2 * nodes, 2 * nodes] += value
        alpha, beta = self.problem.damping.alpha, self.problem.damping.beta
        damping = alpha * stiffness + beta * mass
        self.c = alpha * self.k
        kind = self.problem.train.placements[0].data
        assert isinstance(kind, LumpedData)
        (k1, k2), (c1, c2) = kind.stiffnesses, kind.dampings
        mass[n:, n:] = np.diag(kind.masses)
        stiffness[n:, n:] = [[k1, -k1], [-k1, k1 + k2]]
        damping[n:, n:] = [[c1, -c1], [-c1, c1 + c2]]
        self.load = np.zeros(self.size)
        place = self.problem.train.placements[0]
        assert place.nominal_height is not None
        self.load[-1] = place.static_force + k2 * (place.nominal_height + place.static_force / k1)
        self.free = np.setdiff1d(np.arange(self.size), 2 * mesh.anchors)
        self.matrices = mass, damping, stiffness

    def meets(self, x: float) -> tuple[np.ndarray, float]:
        """How the depth of the head at ``x`` [m] follows from the unknowns: direction and rest."""
        nodes = self.mesh.wires[CONTACT_WIRE]
        places = self.mesh.points[nodes, 0]
        e = int(np.searchsorted(places, x)) - 1
        functions = hermite(places[e + 1] - places[e])
        values = np.array([f(x - places[e]) for f in functions])
        direction = np.zeros(self.size)
        for side in (0, 1):
            node = nodes[e + side]
            direction[[2 * node, 2 * node + 1]] = -values[2 * side : 2 * side + 2]
        rest = direction[2 * nodes] @ self.form.height[nodes]
        rest += direction[2 * nodes + 1] @ self.form.slope[nodes]
        direction[-2] = 1.0
        return direction, float(rest)

    def step(self, x: float, every_set: bool = False) -> tuple[float, np.ndarray]:
        """A step of average acceleration to a head at ``x`` [m]: contact and dropper forces [N].

        ``every_set`` tries all sets and counts in ``tried`` those that fit; otherwise the search
        begins at the set of the step before and ends at the first that fits.
        """
        dt = self.problem.numerics.dt
        mass, damping, stiffness = self.matrices
        d, v, a = self.state
        d, v = d + dt * v + dt**2 / 4 * a, v + dt / 2 * a
        direction, rest = self.meets(x)
        law = self.problem.contact.stiffness  # type: ignore[union-attr]
        step = mass + dt / 2 * damping + dt**2 / 4 * stiffness
        right = self.load - damping @ v - stiffness @ d
        c = 0.0 if self.dampers_act else self.c
        worth = (1.0 - self.share) * (self.k * dt**2 / 4 + c * dt / 2)
        known = self.form.dropper_force + self.pull @ (self.k * d + c * v)
        found: list[tuple[frozenset[int], np.ndarray, np.ndarray, float]] = []
        for acts in self._sets():
            matrix, force = step.copy(), right.copy()
            for number in acts - {-1}:
                pull = self.pull[number]
                matrix -= worth * np.outer(pull, pull)
                force += (1.0 - self.share) * known[number] * pull
            if -1 in acts:
                matrix += law * dt**2 / 4 * np.outer(direction, direction)
                force -= law * (direction @ d + rest) * direction
            new = np.zeros(self.size)
            new[self.free] = np.linalg.solve(matrix[np.ix_(self.free, self.free)], force[self.free])
            tension = known + (self.k * dt**2 / 4 + c * dt / 2) * self.pull @ new
            depth = float(direction @ (d + dt**2 / 4 * new) + rest)
            slack = {number for number in range(tension.size) if tension[number] < 0.0}
            if slack | ({-1} if depth > 0.0 else set()) == acts:
                found.append((acts, new, tension, depth))
                if not every_set:
                    break
        self.tried = len(found)
        self.acting, new, tension, depth = found[0]
        self.state = np.array([d + dt**2 / 4 * new, v + dt / 2 * new, new])
        return law * max(depth, 0.0), np.where(tension < 0.0, self.share * tension, tension)

    def _sets(self) -> Iterator[frozenset[int]]:
        """All sets of slack droppers and of -1, the contact; those near the latest one first."""
        whole = [-1, *range(len(self.pull))]
        for distance in range(len(whole) + 1):
            for other in combinations(whole, distance):
                yield self.acting ^ frozenset(other)
