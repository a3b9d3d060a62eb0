"""Line and lumped pantographs as one nonlinear system of second order, for PETSc's own steppers.

    M u'' + C u' + K u + sum over slack droppers of s L - sum over contacts of f N = loads
    m z'' + c z' + k z + f e = lift

with f = k_c (z - h) + d_c (z' - h'), not below zero where contact can be lost, and s what a dropper
would push, or its spring alone. Of the solver's step nothing is used here, neither predictions nor
compliances nor the small problem of contacts and droppers: it is a second opinion. M, C and K are
the model's.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy import sparse

from catenary.mbs.head.newmark_head import raised
from catenary.mbs.lumped_data import LumpedData
from catenary.solver.integrators.line_loads import LineLoads
from catenary.solver.model.matrices import iterate_entries
from catenary.solver.model.model import Model
from catenary.solver.model.shape_functions import shape_slopes, shape_values
from catenary.solver.problem.contact_laws import LinearLaw
from catenary.solver.problem.problem import Placement, Problem
from catenary.solver.statics.equilibrium import Equilibrium


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
        # What the base spring pushes where masses are at that level: it carries nothing when the
        # head presses with the static force at its nominal height.
        self._base = np.array(
            [
                kind.stiffnesses[-1]
                * (
                    nominal_height(place)
                    - self.level
                    + sum(place.static_force / k for k in kind.stiffnesses[:-1])
                )
                for place, kind in zip(train.placements, data, strict=True)
            ]
        )
        nodes = model.contact_nodes
        self._x = model.mesh.x(nodes)
        self._wire = np.stack([model.dofs(nodes), model.dofs(nodes, "theta_y")], axis=1)
        self._rest = np.stack([form.height[nodes], form.slope[nodes]], axis=1)
        self._held = model.constrained
        self._set_matrices(model, data, ends)

        self._ends = model.dofs(model.mesh.droppers)
        self._dropper = (form.dropper_force, model.dropper_stiffness, model.released_damping)
        self._pushed = 1.0 - model.simulated.kept_ratio
        upper, lower = self._ends.T
        pairs = [(i, j) for i in (upper, lower) for j in (upper, lower)]
        self._dropper_at = np.stack([self._at(i, j) for i, j in pairs], axis=1)

    def _set_matrices(self, model: Model, data: list[LumpedData], ends: np.ndarray) -> None:
        """M, C and K on one pattern, which also holds each head beside all of the contact wire."""
        heads = np.repeat(self.heads, self._wire.size)
        wires = np.tile(self._wire.ravel(), self.heads.size)
        rows, columns = np.concatenate([heads, wires]), np.concatenate([wires, heads])
        parts = [(rows, columns, np.zeros((3, rows.size)))]
        for which in range(3):
            coefficients = np.eye(3)[which]
            for i, j, value in iterate_entries(model, 0, model.n_dofs, *coefficients):
                values = np.zeros((3, i.size))
                values[which] = value
                parts.append((i, j, values))
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

    def tension(self, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """What of all droppers goes slack, as if it could push [N], (n_droppers,)."""
        rest, stiffness, damping = self._dropper
        upper, lower = self._ends.T
        return np.asarray(
            rest + stiffness * (u[upper] - u[lower]) + damping * (v[upper] - v[lower])
        )

    def residual(self, time: float, u: np.ndarray, v: np.ndarray, a: np.ndarray) -> np.ndarray:
        """F(t, u, v, a), (n,) [N]; at held unknowns u itself."""
        result = self._mass @ a + self._damping @ v + self._stiffness @ u
        grown = raised(time, self._train.raise_time)
        result[self._carriers] -= grown * self._static + self._base
        if self._loads is not None:
            self._loads.at(time)
            result[: self.n_line] -= self._loads.values
        force, _, meets = self.contacts(time, u, v)
        for f, (dofs, along, _) in zip(force, meets, strict=True):
            result[dofs] += f * along
        if self._pushed:
            compensation = self._pushed * np.maximum(0.0, -self.tension(u, v))
            np.add.at(result, self._ends[:, 0], compensation)
            np.subtract.at(result, self._ends[:, 1], compensation)
        result[self._held] = u[self._held]
        return np.asarray(result)

    def jacobian(
        self, time: float, u: np.ndarray, v: np.ndarray, by_v: float, by_a: float
    ) -> np.ndarray:
        """dF/du + ``by_v`` dF/dv + ``by_a`` dF/da: values of the pattern's entries."""
        result = by_a * self._mass.data + by_v * self._damping.data + self._stiffness.data
        law = self._law
        force, _, meets = self.contacts(time, u, v)
        for f, (dofs, along, convective) in zip(force, meets, strict=True):
            if f > 0.0 or self._pulls:
                by_u = (law.stiffness + by_v * law.damping) * along + law.damping * convective
                at = self._at(np.repeat(dofs, dofs.size), np.tile(dofs, dofs.size))
                result[at] += np.outer(along, by_u).ravel()
        if self._pushed:
            _, stiffness, damping = self._dropper
            slack = self.tension(u, v) < 0.0
            change = self._pushed * (stiffness + by_v * damping)[slack]
            signs = np.array([1.0, -1.0, -1.0, 1.0])
            np.subtract.at(result, self._dropper_at[slack], change[:, None] * signs)
        return np.asarray(result)
