"""A line as a network of straight bars in space: a second opinion on lines at rest.

It shares the description of a line with the program (wires, droppers, hardware, nodes), and none of
its mechanics. At the installation each bar has the force density T / h, so that lengths of droppers
follow from two linear systems, of heights and of lateral positions. Any other rest is the
equilibrium of elastic bars of those lengths in their true geometry, without bending: wires,
droppers that only pull, steady arms between clamp and hinge, springs, weights. Newton's method
finds it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse import linalg

from catenary.meshgen.line import Line
from catenary.meshgen.mesh import LineMesh
from catenary.meshgen.wires import End

# Of a steady arm along itself [N/m].
ARM = 1e7
_EVERY = np.eye(3)


@dataclass
class Springs:
    """Straight springs between nodes, or from nodes to places: ``other`` (n,) or (n, 3)."""

    node: np.ndarray
    other: np.ndarray
    stiffness: np.ndarray
    length: np.ndarray
    only_pull: bool = False


class BarNetwork:
    """The network of a line of wires without bending stiffness.

    Parameters
    ----------
    line, mesh : Line, LineMesh
        Wires and what hangs between them, and the places of its nodes.
    inclination : float
        Of the steady arms at the installation [rad].
    tensioned : callable
        Whether the wires that end at a place along the track [m] have weights there.
    gravity : float
        [m/s2].
    """

    def __init__(
        self,
        line: Line,
        mesh: LineMesh,
        inclination: float,
        tensioned: Callable[[float], bool],
        gravity: float,
    ) -> None:
        self.mesh, self.gravity = mesh, gravity
        n = mesh.n_nodes
        self.x, self.mass, self.drag = mesh.points[:, 0], np.zeros(n), np.zeros(n)
        self.held_y: dict[int, float] = {}
        self.held_z: dict[int, float] = {}
        self.held_x: set[int] = set()
        self.pull = np.zeros(n)
        self._wires(line, tensioned)
        self._droppers(line)
        self.clamp_k = np.concatenate(
            [np.zeros(0), *(np.full(len(one.x), one.stiffness) for one in line.clamps)]
        )
        masses = [np.full(len(one.x), 0.5 * one.mass) for one in line.clamps]
        for side in mesh.clamps.T:
            np.add.at(self.mass, side, np.concatenate([np.zeros(0), *masses]))
        owner = {int(node): line.wire(name) for name in mesh.wires for node in mesh.wires[name]}
        kinds = [group.kind for group in line.steady_arms]
        arms = [kinds[group] for group in mesh.arm_group]
        self.arm_length = np.array([kind.length for kind in arms])
        self.slope = np.tan(inclination)
        for node, kind in zip(mesh.steady_arms.tolist(), arms, strict=True):
            self.mass[node] += kind.clamp_mass + 0.5 * kind.mass_per_length * kind.length
        self.support_k = np.array([line.supports[g].stiffness for g in mesh.support_group])
        for node in (*mesh.steady_arms.tolist(), *mesh.supports.tolist()):
            self.held_y[node] = float(owner[node].points(self.x[[node]])[0, 1])
        self.support_z = np.array([owner[int(i)].points(self.x[[i]])[0, 2] for i in mesh.supports])
        self._hang()

    def _wires(self, line: Line, tensioned: Callable[[float], bool]) -> None:
        mesh = self.mesh
        bars = []
        for wire in line.wires:
            pairs = mesh.elements(wire.name)
            h = np.diff(self.x[pairs], axis=1)[:, 0]
            tension = wire.tension_at(self.x[pairs].mean(axis=1))
            for side in pairs.T:
                np.add.at(self.mass, side, 0.5 * wire.mass_per_length * h)
                np.add.at(self.drag, side, 0.5 * (wire.diameter or 0.0) * wire.drag_coefficient * h)
            alike = np.ones(h.size)
            figures = (tension / h, (wire.axial_stiffness or 0.0) * alike, wire.expansion * alike)
            bars.append((pairs, *figures))
            for piece, nodes in zip(wire.pieces, mesh.pieces(wire.name), strict=True):
                for node, sign, kind in zip(nodes[[0, -1]], (-1.0, 1.0), piece.ends, strict=True):
                    if kind is not End.HELD:
                        continue
                    _, y, z = wire.points(self.x[[node]])[0]
                    self.held_y[int(node)], self.held_z[int(node)] = float(y), float(z)
                    if tensioned(float(self.x[node])):
                        self.pull[node] = sign * wire.tension
                    else:
                        self.held_x.add(int(node))
        self.bars, self.density, self.stiffness, self.expansion = map(
            np.concatenate, zip(*bars, strict=True)
        )

    def _droppers(self, line: Line) -> None:
        mesh = self.mesh
        kinds = [group.kind for group in line.droppers]
        own = [kinds[group] for group in mesh.dropper_group]
        self.dropper_k = np.array([kind.stiffness for kind in own], dtype=float)
        self.dropper_mass = np.array([kind.mass_per_length for kind in own])
        self.wanted = np.zeros(len(own))
        for i, (upper, lower) in enumerate(mesh.droppers.tolist()):
            self.mass[upper] += own[i].upper_clamp_mass
            self.mass[lower] += own[i].lower_clamp_mass
            profile = line.wire(line.droppers[mesh.dropper_group[i]].lower).profile
            assert profile is not None
            at = self.x[[lower]]
            self.wanted[i] = (profile.level(at) - profile.pre_sag(at))[0]

    def _laplacian(self, pairs: np.ndarray, weights: np.ndarray) -> sparse.csr_matrix:
        i, j = pairs.T
        rows, columns = np.concatenate([i, j, i, j]), np.concatenate([i, j, j, i])
        values = np.concatenate([weights, weights, -weights, -weights])
        return sparse.csr_matrix((values, (rows, columns)), shape=(self.x.size,) * 2)

    def _hang(self) -> None:
        """Shape and lengths at the installation, by turns of both planes and dropper weights."""
        mesh, n = self.mesh, self.x.size
        (upper, lower), d = mesh.droppers.T, len(mesh.droppers)
        wires = self._laplacian(self.bars, self.density)
        wires = wires + self._laplacian(mesh.clamps, self.clamp_k)
        ones, each = np.ones(d), np.arange(d)
        lifts = sparse.csr_matrix(
            (np.concatenate([ones, -ones]), (np.concatenate([lower, upper]), np.tile(each, 2))),
            shape=(n, d),
        )
        springs = sparse.csr_matrix((self.support_k, (mesh.supports, mesh.supports)), shape=(n, n))
        free_z = np.setdiff1d(np.arange(n), [*self.held_z, *lower])
        rows = np.setdiff1d(np.arange(n), list(self.held_z))
        free_y = np.setdiff1d(np.arange(n), list(self.held_y))
        system = sparse.hstack([(wires + springs)[rows][:, free_z], -lifts[rows]]).tocsc()
        length, lift = np.ones(d), np.zeros(n)
        z, y = np.zeros(n), np.zeros(n)
        z[list(self.held_z)], z[lower] = list(self.held_z.values()), self.wanted
        y[list(self.held_y)] = list(self.held_y.values())
        for _ in range(60):
            self.weight = self.gravity * self.mass
            for side in (upper, lower):
                np.add.at(self.weight, side, 0.5 * self.gravity * self.dropper_mass * length)
            load = lift - self.weight
            np.add.at(load, mesh.supports, self.support_k * self.support_z)
            z[free_z] = 0.0
            found = linalg.spsolve(system, (load - (wires + springs) @ z)[rows])
            z[free_z], force = found[: free_z.size], found[free_z.size :]
            lateral = wires + self._laplacian(mesh.droppers, force / (z[upper] - z[lower]))
            y[free_y] = 0.0
            y[free_y] = linalg.spsolve(lateral[free_y][:, free_y].tocsc(), -(lateral @ y)[free_y])
            radial = (lateral @ y)[mesh.steady_arms]
            lift = np.zeros(n)
            lift[mesh.steady_arms] = np.abs(radial) * self.slope
            apart = np.hypot(z[upper] - z[lower], y[upper] - y[lower])
            before, length = length, apart - force * apart / (z[upper] - z[lower]) / self.dropper_k
            if np.abs(length - before).max() < 1e-11:
                break
        self.installed = np.column_stack([self.x, y, z])
        along = np.diff(self.x[self.bars], axis=1)[:, 0]
        step = self.installed[self.bars[:, 1]] - self.installed[self.bars[:, 0]]
        whole = np.linalg.norm(step, axis=1)
        self.bar_length = whole / (1.0 + self.density * whole / self.stiffness)
        self.dropper_length = length
        # Clamps hand over what the tension of one wire falls where another one begins.
        handed = np.zeros(n)
        np.add.at(handed, self.bars[:, 0], self.density * along)
        np.add.at(handed, self.bars[:, 1], -self.density * along)
        self.handed = handed[mesh.clamps[:, 1]]
        towards = np.column_stack([0.0 * radial, np.sign(radial), self.slope + 0.0 * radial])
        place = self.installed[mesh.steady_arms]
        cosine = 1.0 / np.hypot(1.0, self.slope)
        self.hinge = place + towards * (cosine * self.arm_length)[:, None]
        self.arm_cut = self.arm_length - np.abs(radial) / cosine / ARM

    def rest(self, warmer: float, pressure: float) -> tuple[np.ndarray, np.ndarray]:
        """Places of the nodes (n, 3) [m] and forces of the droppers [N] at another temperature [K]
        under a wind to the left of the ``pressure`` 1/2 rho U^2 [N/m2]."""
        mesh, n = self.mesh, self.x.size
        grown = self.bar_length * (1.0 + self.expansion * warmer)
        upper, lower = mesh.droppers.T
        arms = np.full(self.arm_cut.size, ARM)
        self._droppers_at = Springs(upper, lower, self.dropper_k, self.dropper_length, True)
        first, second = self.bars.T
        springs = (
            Springs(first, second, self.stiffness / grown, grown),
            Springs(mesh.steady_arms, self.hinge, arms, self.arm_cut),
            self._droppers_at,
        )
        load = np.column_stack([self.pull, pressure * self.drag, -self.weight])
        only_arms = np.setdiff1d(list(self.held_y), mesh.steady_arms)
        held = np.concatenate(
            [
                3 * np.array(list(self.held_x)),
                3 * only_arms + 1,
                3 * np.array(list(self.held_z)) + 2,
            ]
        ).astype(int)
        self._free = np.setdiff1d(np.arange(3 * n), held)
        place = self.installed.copy()
        for _ in range(60):
            force, self._tangent = self._balance(place, load, springs)
            free = self._tangent[self._free][:, self._free].tocsc()
            step = linalg.spsolve(free, force.ravel()[self._free])
            place.ravel()[self._free] += step
            if np.abs(step).max() < 1e-8:  # the next one would be its square
                break
        else:
            raise AssertionError(f"no rest: the last step is {np.abs(step).max():.2g} m")
        stretch = np.linalg.norm(place[lower] - place[upper], axis=1) - self.dropper_length
        return place, np.maximum(self.dropper_k * stretch, 0.0)

    def _balance(
        self, place: np.ndarray, load: np.ndarray, springs: tuple[Springs, ...]
    ) -> tuple[np.ndarray, sparse.csr_matrix]:
        """Force on each node and minus its derivative by the places."""
        mesh, force, blocks = self.mesh, load.copy(), []
        for own in springs:
            between = own.other.ndim == 1
            way = (place[own.other] if between else own.other) - place[own.node]
            length = np.linalg.norm(way, axis=1)
            unit, k = way / length[:, None], own.stiffness
            tension = k * (length - own.length)
            if own.only_pull:
                k, tension = np.where(tension > 0.0, k, 0.0), np.maximum(tension, 0.0)
            along = unit[:, :, None] * unit[:, None, :]
            block = k[:, None, None] * along + (tension / length)[:, None, None] * (_EVERY - along)
            np.add.at(force, own.node, tension[:, None] * unit)
            blocks.append((own.node, own.node, block))
            if between:
                np.add.at(force, own.other, -tension[:, None] * unit)
                i, j = own.node, own.other
                blocks += [(j, j, block), (i, j, -block), (j, i, -block)]
        i, j = mesh.clamps.T
        pull = self.clamp_k[:, None] * (place[j] - place[i])
        pull[:, 0] += self.handed
        np.add.at(force, i, pull)
        np.add.at(force, j, -pull)
        block = self.clamp_k[:, None, None] * _EVERY
        blocks += [(i, i, block), (j, j, block), (i, j, -block), (j, i, -block)]
        force[mesh.supports, 2] -= self.support_k * (place[mesh.supports, 2] - self.support_z)
        upright = self.support_k[:, None, None] * np.diag([0.0, 0.0, 1.0])
        blocks.append((mesh.supports, mesh.supports, upright))
        rows, columns, values = (
            np.concatenate(part)
            for part in zip(*(_entries(*block) for block in blocks), strict=True)
        )
        return force, sparse.csr_matrix((values, (rows, columns)), shape=(place.size,) * 2)

    def compliance(self, nodes: np.ndarray) -> np.ndarray:
        """Lift of each of some nodes under a unit force on it at the last rest, (n,) [m/N]."""
        factor = linalg.splu(self._tangent[self._free][:, self._free].tocsc())
        found = []
        for number in np.searchsorted(self._free, 3 * nodes + 2):
            unit = np.zeros(self._free.size)
            unit[number] = 1.0
            found.append(factor.solve(unit)[number])
        return np.array(found)


def _entries(
    i: np.ndarray, j: np.ndarray, block: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    axes = np.arange(3)
    rows = np.broadcast_to(3 * i[:, None, None] + axes[:, None], block.shape)
    columns = np.broadcast_to(3 * j[:, None, None] + axes, block.shape)
    return rows.ravel(), columns.ravel(), block.ravel()
