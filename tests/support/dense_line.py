"""A small line with its train as dense matrices, stepped with every set of slack droppers tried.

Written from the equations with NumPy alone: elements by Gauss quadrature, Newmark's formulas on all
unknowns at once, and the set of slack droppers and of contact found by trying sets until one fits
its own signs. Of the solver it takes places, heights and dropper forces at rest.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from itertools import combinations

import numpy as np
from numpy.polynomial import Polynomial

from catenary.mbs.lumped import LumpedData
from catenary.meshgen.mesh import LineMesh
from catenary.meshgen.wires import Role
from catenary.solver.model.rest_shape import Equilibrium
from catenary.solver.problem.problem import Problem

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


@dataclass(frozen=True)
class DenseLink:
    """A link that only pulls: ``terms`` are wire, place [m] and weight of what its stretch is made
    of, then stiffness [N/m] and the gap at rest [m], None if it is taut there without a force."""

    terms: tuple[tuple[str, float, float], ...]
    stiffness: float
    gap: float | None = None


@dataclass
class DenseLine:
    """Wires with what joins them, and one lumped pantograph of two masses under the contact wires.

    Unknowns are w and dw/dx of each mesh node by its number, then the masses' heights, head first.
    ``dampers_act`` tells whether a slack dropper keeps its damper, ``share`` what it keeps besides.
    ``further`` links only pull; in sets they follow the droppers.
    """

    problem: Problem
    mesh: LineMesh
    form: Equilibrium
    dampers_act: bool
    share: float = 0.0
    further: tuple[DenseLink, ...] = ()
    tried: int = 0
    acting: frozenset[int] = frozenset()
    state: np.ndarray = field(default_factory=lambda: np.zeros(0))
    contact_forces: np.ndarray = field(default_factory=lambda: np.zeros(0))

    def __post_init__(self) -> None:
        line, mesh = self.problem.line, self.mesh
        n = 2 * mesh.n_nodes
        self.size = n + 2
        mass, stiffness = np.zeros((2, self.size, self.size))
        for data in line.wires:
            for left, right in mesh.elements(data.name):
                length = mesh.points[right, 0] - mesh.points[left, 0]
                place = 0.5 * length * (1.0 + _POINTS)
                own = np.ix_(*2 * [[2 * left, 2 * left + 1, 2 * right, 2 * right + 1]])
                shape = np.array([f(place) for f in hermite(length)])
                slope = np.array([f.deriv()(place) for f in hermite(length)])
                bend = np.array([f.deriv(2)(place) for f in hermite(length)])
                weights = 0.5 * length * _WEIGHTS
                mass[own] += data.mass_per_length * (shape * weights) @ shape.T
                tension = data.tension_at(0.5 * mesh.points[[left, right], 0].sum())
                stiffness[own] += tension * (slope * weights) @ slope.T
                stiffness[own] += data.bending_stiffness * (bend * weights) @ bend.T
        self.pull = np.zeros((len(mesh.droppers), self.size))
        for row, (upper, lower) in zip(self.pull, mesh.droppers, strict=True):
            row[2 * upper], row[2 * lower] = 1.0, -1.0
        kinds = [group.kind.stiffness for group in line.droppers]
        self.n_droppers = n_droppers = len(self.pull)
        own = [self.direction(link)[None] for link in self.further]
        self.pull = np.concatenate([self.pull, *own])
        # Of each link: stiffness, force at rest, whether it stands open there.
        springs = [link.stiffness for link in self.further]
        self.spring = np.append(np.array(kinds, dtype=float)[mesh.dropper_group], springs)
        rests = [-link.stiffness * (link.gap or 0.0) for link in self.further]
        self.rest = np.append(self.form.dropper_force, rests)
        self.open = np.zeros(self.spring.size, dtype=bool)
        self.open[n_droppers:] = [link.gap is not None for link in self.further]
        taut = np.where(self.open, 0.0, self.spring)
        stiffness += (self.pull.T * taut) @ self.pull
        for nodes, group, values in (
            (mesh.supports, mesh.support_group, [own.stiffness for own in line.supports]),
            (mesh.steady_arms, mesh.arm_group, [own.kind.stiffness for own in line.steady_arms]),
        ):
            stiffness[2 * nodes, 2 * nodes] += np.array(values)[group]
        for (upper, lower), number in zip(mesh.clamps, line.clamp_group, strict=True):
            own = np.ix_(*2 * [[2 * upper, 2 * lower]])
            stiffness[own] += line.clamps[number].stiffness * np.array([[1.0, -1.0], [-1.0, 1.0]])
        alpha, beta = self.problem.damping.alpha, self.problem.damping.beta
        damping = alpha * stiffness + beta * mass
        self.alpha = alpha
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

    def direction(self, link: DenseLink) -> np.ndarray:
        """Stretch of a link as weights of all unknowns."""
        result = np.zeros(self.size)
        for wire, x, weight in link.terms:
            nodes = self.mesh.wires[wire]
            places = self.mesh.points[nodes, 0]
            e = int(np.searchsorted(places, x)) - 1
            values = [f(x - places[e]) for f in hermite(places[e + 1] - places[e])]
            for side in (0, 1):
                node = nodes[e + side]
                result[[2 * node, 2 * node + 1]] += weight * np.array(
                    values[2 * side : 2 * side + 2]
                )
        return result

    def meets(self, x: float, contact: int = 0) -> tuple[np.ndarray, float]:
        """How the depth of the head at ``x`` [m] in a contact wire follows from the unknowns:
        direction and rest; out of reach where the wire is not."""
        wire = self.problem.line.wires_of(Role.CONTACT)[contact]
        nodes = self.mesh.wires[wire.name]
        places = self.mesh.points[nodes, 0]
        if not places[0] < x <= places[-1]:
            return np.zeros(self.size), -1.0
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
        """A step of average acceleration to a head at ``x`` [m]: forces of contact and links [N].

        ``every_set`` tries all sets and counts in ``tried`` those that fit; otherwise the search
        begins at the set of the step before and ends at the first that fits.
        """
        dt = self.problem.numerics.dt
        _, damping, stiffness = self.matrices
        d, v, a = self.state
        d, v = d + dt * v + dt**2 / 4 * a, v + dt / 2 * a
        n_contacts, n_links = len(self.problem.line.wires_of(Role.CONTACT)), len(self.pull)
        contacts = [self.meets(x, number) for number in range(n_contacts)]
        law = self.problem.contact.stiffness  # type: ignore[union-attr]
        kept = np.append(np.full(self.n_droppers, self.share), np.zeros(len(self.further)))
        c = self.alpha * self.spring
        if self.dampers_act:
            c[: self.n_droppers] = 0.0
        # What an acceleration is worth in a link's force, and what acting changes of it.
        worth = self.spring * dt**2 / 4 + c * dt / 2
        change = np.where(self.open, 1.0, kept - 1.0)
        known = self.rest + self.spring * (self.pull @ d) + c * (self.pull @ v)
        # Links, then contacts: what acting adds along each direction to the matrix and to the load.
        along = np.array([*self.pull, *(direction for direction, _ in contacts)])
        depth_before = np.array([direction @ d + rest for direction, rest in contacts])
        added = np.append(change * worth, np.full(n_contacts, law * dt**2 / 4))
        load = -np.append(change * known, law * depth_before)
        answers = self._inverse @ along.T
        free = self._inverse @ (self.load - damping @ v - stiffness @ d)
        between, of_free = along @ answers, along @ free
        found: list[tuple[frozenset[int], np.ndarray, np.ndarray, np.ndarray]] = []
        for acts in self._sets():
            rows = [n if n >= 0 else n_links - n - 1 for n in sorted(acts)]
            # Forces along the directions that act, and what all directions move by.
            own = np.eye(len(rows)) + added[rows, None] * between[np.ix_(rows, rows)]
            forces = np.linalg.solve(own, load[rows] - added[rows] * of_free[rows])
            moves = of_free + between[:, rows] @ forces
            tension = known + worth * moves[:n_links]
            depth = depth_before + dt**2 / 4 * moves[n_links:]
            beyond = np.where(self.open, tension > 0.0, tension < 0.0)
            switched = set(np.flatnonzero(beyond).tolist())
            if switched | set((-1 - np.flatnonzero(depth > 0.0)).tolist()) == acts:
                found.append((acts, free + answers[:, rows] @ forces, tension, depth))
                if not every_set:
                    break
        self.tried = len(found)
        self.acting, new, tension, depth = found[0]
        self.state = np.array([d + dt**2 / 4 * new, v + dt / 2 * new, new])
        self.contact_forces = law * np.maximum(depth, 0.0)
        return float(self.contact_forces.sum()), np.where(tension < 0.0, kept * tension, tension)

    @cached_property
    def _inverse(self) -> np.ndarray:
        """Of the matrix of a step in which no link is switched and nothing touches; zero for held
        unknowns. A set that acts changes the matrix along a few directions only."""
        dt = self.problem.numerics.dt
        mass, damping, stiffness = self.matrices
        step = mass + dt / 2 * damping + dt**2 / 4 * stiffness
        result = np.zeros((self.size, self.size))
        result[np.ix_(self.free, self.free)] = np.linalg.inv(step[np.ix_(self.free, self.free)])
        return result

    def _sets(self) -> Iterator[frozenset[int]]:
        """All sets of switched links and of -1, -2 ..., the contacts; those near the latest one
        first."""
        n_contacts = len(self.problem.line.wires_of(Role.CONTACT))
        whole = [*range(-n_contacts, 0), *range(len(self.pull))]
        for distance in range(len(whole) + 1):
            for other in combinations(whole, distance):
                yield self.acting ^ frozenset(other)
