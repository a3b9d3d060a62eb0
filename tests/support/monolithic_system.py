"""Line and lumped pantographs as one nonlinear system of second order, for PETSc's own steppers.

    M u'' + C u' + K u + sum over switched links of s L - sum over contacts of f N = loads
    m z'' + c z' + k z + f e = lift

with f = k_c (z - h) + d_c (z' - h'), not below zero where contact can be lost, and s the
compensation of a link, such as what a dropper would push. Of the solver's step nothing is used
here, neither predictions nor compliances nor the small problem of contacts and links: it is a
second opinion. M, C, K and the links' reserve are the model's.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy import sparse

from catenary.mbs.air import AirForces
from catenary.mbs.build import steady_forces
from catenary.mbs.head.stepping import Raising
from catenary.mbs.lumped import LumpedData
from catenary.solver.integrators.line_loads import LineLoads
from catenary.solver.model.beam import shape_slopes, shape_values
from catenary.solver.model.matrices import iterate_sums
from catenary.solver.model.model import Model
from catenary.solver.model.rest_shape import Equilibrium
from catenary.solver.model.switching_links import some_of, switching_links
from catenary.solver.problem.contact_laws import LinearLaw
from catenary.solver.problem.problem import Placement, Problem
from catenary.solver.wind import airflow


class WholeSystem:
    """F(t, u, v, a) = 0 with its Jacobian in one fixed pattern. On one rank; not collective.

    The unknowns are the line's, then the heights of each pantograph's masses above ``level``, head
    first.

    Attributes
    ----------
    n, n_line : unknowns of all and of the line
    heads : (n_pantographs,) numbers of the heads' heights
    level : height from which masses are measured, so that their heights are small numbers [m]
    indptr, indices : rows of the Jacobian in compressed form

    Parameters
    ----------
    nominal_height : of a head under its static force at rest [m]
    loads : of the line, None if there are none
    """

    def __init__(
        self,
        problem: Problem,
        model: Model,
        form: Equilibrium,
        nominal_height: Callable[[Placement], float],
        loads: LineLoads | None,
    ) -> None:
        train, law = problem.train, model.simulated.contact
        assert isinstance(law, LinearLaw)
        self._train, self._loads = train, loads
        self._pulls = not model.simulated.contact_loss
        self._law = law
        self.n_line = model.n_dofs
        data = []
        for placement in train.placements:
            assert isinstance(placement.data, LumpedData)
            data.append(placement.data)
        ends = self.n_line + np.cumsum([0, *(kind.n_masses for kind in data)])
        self.heads, self._carriers = ends[:-1], ends[1:] - 1
        self.n = int(ends[-1])
        self._behind = np.array([placement.behind for placement in train.placements])
        self._static = np.array([placement.static_force for placement in train.placements])
        self.level = nominal_height(train.placements[0])
        flows = [airflow(problem, model.simulated, place) for place in train.placements]
        self._air = [
            (p, AirForces(flow, kind.uplift, train.raise_time))
            for p, (flow, kind) in enumerate(zip(flows, data, strict=True))
            if flow is not None
        ]
        on_frame = [
            0.0 if flow is None else steady_forces(kind, flow.speed).on_frame
            for flow, kind in zip(flows, data, strict=True)
        ]
        # Push of the base spring where masses are at that level: it carries nothing when the
        # head presses with the static force at its nominal height.
        self._base = np.array(
            [
                kind.stiffnesses[-1]
                * (
                    nominal_height(place)
                    - self.level
                    + sum((place.static_force + lifted) / k for k in kind.stiffnesses[:-1])
                )
                for place, kind, lifted in zip(train.placements, data, on_frame, strict=True)
            ]
        )
        # Of chains that are tied to their bases, these rise with the lift: spring and damper, 0 of
        # others, and from where, see ``place``.
        tied = np.array([kind.tied for kind in data])
        self._rises = tied * np.array([[k.stiffnesses[-1], k.dampings[-1]] for k in data]).T
        self._way = np.zeros(tied.size)
        nodes = model.contact_nodes
        self._x = model.mesh.x(nodes)
        self._wire = np.stack([model.dofs(nodes), model.dofs(nodes, "theta_y")], axis=1)
        self._rest = np.stack([form.height[nodes], form.slope[nodes]], axis=1)
        self._held = model.constrained
        self._set_matrices(model, data, ends)

        table = switching_links(model, form.dropper_force)
        kept = np.flatnonzero(table.arrays.law["released"] > 0.0)
        self._links = some_of(table.arrays, kept)
        # Which of them decides on each: dependents go with another.
        self._leader = np.searchsorted(kept, table.leader[kept])
        unknowns, weights, _ = self._links
        m = unknowns.shape[1]
        self._link_at = np.stack(
            [self._at(unknowns[:, i], unknowns[:, j]) for i in range(m) for j in range(m)], axis=1
        )
        self._link_square = (weights[:, :, None] * weights[:, None, :]).reshape(-1, m * m)

    def _set_matrices(self, model: Model, data: list[LumpedData], ends: np.ndarray) -> None:
        """M, C and K on one pattern, which also holds each head beside all of the contact wire."""
        heads = np.repeat(self.heads, self._wire.size)
        wires = np.tile(self._wire.ravel(), self.heads.size)
        rows, columns = np.concatenate([heads, wires]), np.concatenate([wires, heads])
        parts = [(rows, columns, np.zeros((3, rows.size)))]
        each = [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)]
        parts += iterate_sums(model, 0, model.n_dofs, each)
        held = np.zeros((3, self._held.size))
        held[1] = 1.0
        parts.append((self._held, self._held, held))
        for kind, first, end in zip(data, ends[:-1], ends[1:], strict=True):
            own = np.arange(first, end)
            blocks = (np.diag(kind.masses), kind.chain(kind.stiffnesses), kind.chain(kind.dampings))
            i, j = np.meshgrid(own, own, indexing="ij")
            parts.append((i.ravel(), j.ravel(), np.stack([block.ravel() for block in blocks])))
        rows, columns = (np.concatenate([part[k] for part in parts]) for k in (0, 1))
        values = np.concatenate([part[2] for part in parts], axis=1)
        matrices = [
            sparse.coo_matrix((one, (rows, columns)), shape=(self.n, self.n)).tocsr()
            for one in values
        ]
        for matrix in matrices:
            matrix.sort_indices()
        self._mass, self._stiffness, self._damping = matrices
        self.indptr, self.indices = matrices[0].indptr, matrices[0].indices

    def _at(self, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
        """Places of entries in the pattern, (n,)."""
        first, last = self.indptr[rows], self.indptr[rows + 1]
        return np.array(
            [
                low + np.searchsorted(self.indices[low:high], column)
                for low, high, column in zip(first, last, columns, strict=True)
            ],
            dtype=np.int64,
        )

    def contacts(
        self, time: float, u: np.ndarray, v: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, list[tuple[np.ndarray, np.ndarray, np.ndarray]]]:
        """Forces [N] and depths [m] (n_pantographs,), and how each contact meets the unknowns.

        The latter are five unknowns of each, head first, the directions of its depth in them, and
        of the part of the depth's rate that the train's speed makes.
        """
        speed, law = self._train.speed, self._law
        force, depth, meets = np.zeros(self.heads.size), np.zeros(self.heads.size), []
        for p, x in enumerate(self._train.start - self._behind + speed * time):
            element = min(max(int(np.searchsorted(self._x, x)) - 1, 0), self._x.size - 2)
            length = float(self._x[element + 1] - self._x[element])
            xi = (x - float(self._x[element])) / length
            value, slope = shape_values(xi, length), shape_slopes(xi, length)
            rest = self._rest[element : element + 2].ravel()
            dofs = np.concatenate([[self.heads[p]], self._wire[element : element + 2].ravel()])
            along = np.concatenate([[1.0], -value])
            convective = np.concatenate([[0.0], -speed * slope])
            depth[p] = along @ u[dofs] + self.level - value @ rest
            rate = along @ v[dofs] + convective @ u[dofs] - speed * slope @ rest
            force[p] = law.stiffness * depth[p] + law.damping * rate
            meets.append((dofs, along, convective))
        return (force if self._pulls else np.maximum(force, 0.0)), depth, meets

    def reserve(self, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Reserve of all links that switch [N], (n_links,)."""
        unknowns, weights, law = self._links
        stretch, speed = ((weights * values[unknowns]).sum(axis=1) for values in (u, v))
        return np.asarray(law["rest"] + law["stiffness"] * stretch + law["damping"] * speed)

    def n_slack(self, u: np.ndarray, v: np.ndarray) -> int:
        """How many links are slack that were taut at rest."""
        switched = self._switched(self.reserve(u, v))
        return int((switched & (self._links.law["carried"] > 0.0)).sum())

    def _switched(self, reserve: np.ndarray) -> np.ndarray:
        """Which links have switched, (n_links,) bool: dependents with their leaders."""
        return np.asarray(reserve[self._leader] < 0.0)

    def place(self, head_height: np.ndarray) -> None:
        """Let bases that rise do so from where heads start, (n_pantographs,) [m]."""
        stiff = self._rises[0] > 0.0
        stands = self.level + self._base[stiff] / self._rises[0, stiff]
        self._way[stiff] = head_height[stiff] - stands

    def residual(self, time: float, u: np.ndarray, v: np.ndarray, a: np.ndarray) -> np.ndarray:
        """F(t, u, v, a), (n,) [N]; at held unknowns u itself."""
        result = self._mass @ a + self._damping @ v + self._stiffness @ u
        grown = Raising(self._train.raise_time)(time)
        result[self._carriers] -= grown * self._static + self._base
        moved = np.array([1.0 - grown, -_raising_rate(time, self._train.raise_time)])
        result[self._carriers] -= self._way * (moved @ self._rises)
        for p, air in self._air:
            on_head, on_frame, _ = air.now(time)
            result[self.heads[p]] -= on_head
            result[self._carriers[p]] -= on_frame
        if self._loads is not None:
            self._loads.at(time)
            result[: self.n_line] -= self._loads.values
        force, _, meets = self.contacts(time, u, v)
        for f, (dofs, along, _) in zip(force, meets, strict=True):
            result[dofs] += f * along
        unknowns, weights, law = self._links
        reserve = self.reserve(u, v)
        compensation = -law["released"] * np.where(self._switched(reserve), reserve, 0.0)
        np.add.at(result, unknowns, compensation[:, None] * weights)
        result[self._held] = u[self._held]
        return np.asarray(result)

    def jacobian(
        self, time: float, u: np.ndarray, v: np.ndarray, by_v: float, by_a: float
    ) -> np.ndarray:
        """dF/du + ``by_v`` dF/dv + ``by_a`` dF/da: values of the pattern's entries."""
        result = by_a * self._mass.data + by_v * self._damping.data + self._stiffness.data
        contact = self._law
        force, _, meets = self.contacts(time, u, v)
        for f, (dofs, along, convective) in zip(force, meets, strict=True):
            if f > 0.0 or self._pulls:
                by_u = (contact.stiffness + by_v * contact.damping) * along
                by_u += contact.damping * convective
                at = self._at(np.repeat(dofs, dofs.size), np.tile(dofs, dofs.size))
                result[at] += np.outer(along, by_u).ravel()
        switched = self._switched(self.reserve(u, v))
        law = self._links.law[switched]
        change = law["released"] * (law["stiffness"] + by_v * law["damping"])
        square = self._link_square[switched]
        np.subtract.at(result, self._link_at[switched], change[:, None] * square)
        return np.asarray(result)


def _raising_rate(time: float, raise_time: float) -> float:
    """Rate of the part of the lift that acts at ``time`` [1/s], see ``raised``."""
    if not 0.0 < time < raise_time:
        return 0.0
    return float(0.5 * np.pi / raise_time * np.sin(np.pi * time / raise_time))
