"""Energy of a line ahead of its train, under it and behind it, found from snapshots of the uplift.

Slopes are those of cubic splines through a wire's nodes. Between two snapshots the uplift is their
mean and the velocity their difference over the time between them: a wave of angular frequency w
loses (w dt)^2 / 12 of its kinetic and (w dt)^2 / 4 of its elastic energy.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from catenary.meshgen.mesh import DROPPERS, LineMesh
from catenary.solver.model.matrices import whole_matrix
from catenary.solver.model.switching_links import switching_links
from catenary.solver.statics.line_at_rest import LineAtRest

# Length of the stretches of line that energy is summed over [m].
STRETCH = 2.0


@dataclass(frozen=True)
class EnergySeen:
    """Energy of the line relative to its rest, over t times and n stretches.

    Attributes
    ----------
    time : (t,) half way between snapshots [s]
    x : (n,) middles of the stretches [m]
    density : (t, n) kinetic and elastic, of all wires and of what hangs between them [J/m]
    """

    time: np.ndarray
    x: np.ndarray
    density: np.ndarray

    @property
    def total(self) -> np.ndarray:
        """(t,) [J]."""
        return np.asarray(self.density.sum(axis=1) * STRETCH)

    def parts(self, position: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Energy behind, between and ahead of places that move (t, p) [m], (t,) each [J].

        Between are those from the last to the first of them; a single one has none. The stretch
        under a place is shared.
        """
        up_to = np.hstack([np.zeros((self.time.size, 1)), np.cumsum(self.density, axis=1)])
        ends = np.append(self.x - 0.5 * STRETCH, self.x[-1] + 0.5 * STRETCH)
        behind, before = (
            np.array([np.interp(at, ends, row) for at, row in zip(places, up_to, strict=True)])
            for places in (position.min(axis=1), position.max(axis=1))
        )
        return (
            behind * STRETCH, (before - behind) * STRETCH, (up_to[:, -1] - before) * STRETCH,
        )  # fmt: skip

    def around(self, place: np.ndarray, reach: float) -> tuple[np.ndarray, np.ndarray]:
        """Distances from a place that moves (t,) [m], up to ``reach``, and the mean over time of
        the density there, (m,) each; NaN where the line never is."""
        relative = np.arange(-reach, reach + STRETCH, STRETCH)
        rows = [
            np.interp(at + relative, self.x, row, left=np.nan, right=np.nan)
            for at, row in zip(place.tolist(), self.density, strict=True)
        ]
        there = np.isfinite(rows)
        n = there.sum(axis=0)
        total = np.where(there, rows, 0.0).sum(axis=0)
        return relative, np.where(n > 0, total / np.maximum(n, 1), np.nan)


class EnergyMotion:
    """Collects the energy of a line from the uplift of its nodes; a `seen.NodeMotion`.

    Parameters
    ----------
    rest : the line
    nodes : (n_nodes,) for each node of its mesh, its number in the uplift that is added
    """

    def __init__(self, rest: LineAtRest, nodes: np.ndarray | None = None) -> None:
        model, mesh = rest.model, rest.mesh
        self._nodes = np.arange(mesh.n_nodes) if nodes is None else nodes
        self._deflection = model.dofs(np.arange(mesh.n_nodes))
        self._slope = model.dofs(np.arange(mesh.n_nodes), "theta_y")
        self._pieces = list(_pieces(mesh))
        self._stiffness, self._mass = (
            whole_matrix(model, **kind).tocsr() for kind in ({"stiffness": 1.0}, {"mass": 1.0})
        )
        self._size, self._x = model.n_dofs, mesh.points[:, 0]
        edges = np.arange(self._x.min(), self._x.max() + STRETCH, STRETCH)
        self._middles = edges[:-1] + 0.5 * STRETCH
        place = np.zeros(model.n_dofs)
        for numbers in (self._deflection, self._slope):
            place[numbers] = self._x
        last = self._middles.size - 1
        self._stretch = np.clip(((place - edges[0]) // STRETCH).astype(int), 0, last)
        # Droppers and their bends: see `_switched`.
        table = switching_links(model, rest.form.dropper_force)
        owner = np.where(table.bent < 0, np.arange(table.bent.size), table.bent)
        mine = np.isin(owner, table.of_component(DROPPERS)) & ~table.rides & ~table.broken
        self._links = table.arrays.of(mine & (table.arrays.law["released"] > 0.0))
        self._link_stretch = self._stretch[self._links.unknowns[:, 0]]
        self._before: tuple[float, np.ndarray] | None = None
        self._times: list[float] = []
        self._rows: list[np.ndarray] = []

    def add(self, time: float, uplift: np.ndarray) -> None:
        """As ``seen.NodeMotion.add``."""
        now = uplift[self._nodes]
        if self._before is not None:
            then, earlier = self._before
            self._times.append(0.5 * (then + time))
            self._rows.append(self._density(0.5 * (earlier + now), (now - earlier) / (time - then)))
        self._before = time, now

    def seen(self) -> EnergySeen:
        """All that was added."""
        return EnergySeen(np.array(self._times), self._middles, np.array(self._rows))

    def _density(self, uplift: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        d, v = self._vector(uplift), self._vector(velocity)
        energy = 0.5 * (d * (self._stiffness @ d) + v * (self._mass @ v))
        n = self._middles.size
        density = np.bincount(self._stretch, energy, n)
        density += np.bincount(self._link_stretch, self._switched(d), n)
        return density / STRETCH

    def _vector(self, values: np.ndarray) -> np.ndarray:
        """Unknowns of the line whose deflections are ``values`` by nodes."""
        vector = np.zeros(self._size)
        vector[self._deflection] = values
        for nodes in self._pieces:
            spline = CubicSpline(self._x[nodes], values[nodes])
            vector[self._slope[nodes]] = spline(self._x[nodes], 1)
        return vector

    def _switched(self, d: np.ndarray) -> np.ndarray:
        """What the energy of droppers differs by from k e^2 / 2 as they are slack, or on another
        slope of their curve than at rest, by link and bend [J].

        A dropper of tension N at rest and stretch e beyond it has (N + k e)^2 / 2 k - N^2 / 2 k -
        N e, the last term being the work of the weights: k e^2 / 2 if it pulls, -N^2 / 2 k - N e if
        not.
        """
        unknowns, weights, law = self._links
        beyond = law["rest"] + law["stiffness"] * (weights * d[unknowns]).sum(axis=1)
        return -law["released"] * np.minimum(beyond, 0.0) ** 2 / (2.0 * law["stiffness"])


def _pieces(mesh: LineMesh) -> list[np.ndarray]:
    """Nodes of each piece of each wire in order of x."""
    none = np.zeros(0, dtype=int)
    return [
        part
        for name, nodes in mesh.wires.items()
        for part in np.split(nodes, mesh.breaks.get(name, none))
    ]
