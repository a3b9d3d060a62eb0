"""A vertical line under pantographs of lumped masses, computed by a second program.

Written from the equations with NumPy and SciPy: elements by Gauss quadrature, form finding with the
droppers' forces as multipliers, average acceleration on all unknowns with banded factors, and slack
droppers and contacts by switching until all signs fit. Of the package it takes inputs only: data of
wires and hardware, wanted heights, a mesh, which may be one of ``plain_mesh.py``.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from force_history import ForceHistory
from scipy import linalg, sparse
from scipy.linalg import lapack
from scipy.sparse import linalg as sparse_linalg

from catenary.mbs.lumped import LumpedData
from catenary.meshgen.mesh import LineMesh
from catenary.meshgen.wires import Role
from catenary.solver.effects.all_effects import simulated
from catenary.solver.problem.problem import Problem

_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(6)
_AT, _SHARE = 0.5 * (1.0 + _POINTS), 0.5 * _WEIGHTS
_MOST_SWITCHES = 200
# Share of the largest one from which on numbers of an answer are left out.
_NOTHING = 1e-14
# The line ahead of the waves does not move: beyond what is left of them there [m], which is looked
# at every so many steps over so long a way [m].
_AT_REST, _LOOK_EVERY, _WAY = 1e-13, 5, 20.0


def cubics(s: np.ndarray, h: np.ndarray) -> np.ndarray:
    """Hermite's functions at shares ``s`` of elements of length ``h``, (4, ...) [-], [m]."""
    return np.array(
        [1 - 3 * s**2 + 2 * s**3, h * s * (1 - s) ** 2, s**2 * (3 - 2 * s), h * s**2 * (s - 1)]
    )


@dataclass
class History(ForceHistory):
    """What a run gives; ``height`` is that of the wire at each step, (n, pantographs) [m]."""

    height: np.ndarray


@dataclass
class PlainLine:
    """The line of a problem on a mesh; unknowns are height and slope of nodes in order of x."""

    problem: Problem
    mesh: LineMesh
    height: np.ndarray = field(init=False)
    tension: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        mesh, line = self.mesh, self.problem.line
        self.size = 2 * mesh.n_nodes
        self.row = np.empty(mesh.n_nodes, dtype=int)
        self.row[np.lexsort((np.arange(mesh.n_nodes), mesh.points[:, 0]))] = np.arange(mesh.n_nodes)
        self.w, self.sorted_x = 2 * self.row, np.sort(mesh.points[:, 0])
        self.mass, self.wires, self.wire_weight = self._wires()
        upper, lower = self.w[mesh.droppers].T
        n, each = len(mesh.droppers), np.arange(len(mesh.droppers))
        self.pull = sparse.csr_matrix(
            (np.repeat([1.0, -1.0], n), (np.tile(each, 2), np.append(upper, lower))),
            shape=(n, self.size),
        )
        self.spring = np.array([g.kind.stiffness for g in line.droppers])[mesh.dropper_group]
        self._rest()
        self._moving()

    def _wires(self) -> tuple[sparse.csc_matrix, sparse.csc_matrix, np.ndarray]:
        """Mass, stiffness and weight per gravity of all wires."""
        parts, weight = [], np.zeros(self.size)
        for wire in self.problem.line.wires:
            pairs = self.mesh.elements(wire.name)
            ends = self.mesh.points[pairs, 0]
            h = (ends[:, 1] - ends[:, 0])[:, None]
            s = np.broadcast_to(_AT, (len(h), _AT.size))
            shape = cubics(s, h)
            slope = np.array(
                [6 * s * (s - 1) / h, (1 - s) * (1 - 3 * s), 6 * s * (1 - s) / h, s * (3 * s - 2)]
            )
            bend = np.array([12 * s - 6, h * (6 * s - 4), 6 - 12 * s, h * (6 * s - 2)]) / h**2
            tension = wire.tension_at(ends.mean(axis=1))[:, None]

            def over(f: np.ndarray, by: np.ndarray, h: np.ndarray = h) -> np.ndarray:
                return np.einsum("iep,jep,ep->eij", f, f, by * h * _SHARE)

            dofs = np.stack([self.w[pairs[:, 0]], self.w[pairs[:, 0]] + 1,
                             self.w[pairs[:, 1]], self.w[pairs[:, 1]] + 1], axis=1)  # fmt: skip
            one = np.ones_like(s)
            mass = over(shape, wire.mass_per_length * one)
            stiffness = over(bend, wire.bending_stiffness * one) + over(slope, tension * one)
            parts.append((dofs, mass, stiffness))
            own = wire.mass_per_length * np.einsum("iep,ep->ei", shape, h * _SHARE * one)
            np.add.at(weight, dofs, own)
        rows = np.concatenate([np.repeat(d, 4, axis=1).ravel() for d, _, _ in parts])
        columns = np.concatenate([np.tile(d, (1, 4)).ravel() for d, _, _ in parts])
        mass, stiffness = (
            sparse.csc_matrix(
                (np.concatenate([part[k].ravel() for part in parts]), (rows, columns)),
                shape=(self.size, self.size),
            )
            for k in (1, 2)
        )
        return mass, stiffness, weight

    def _diagonal(self, nodes: np.ndarray, values: np.ndarray) -> sparse.csc_matrix:
        """A matrix with values at the heights of nodes."""
        at = self.w[nodes]
        return sparse.csc_matrix((values, (at, at)), shape=(self.size, self.size))

    def _rest(self) -> None:
        """Heights at rest and tensions of the droppers, whose masses follow from their lengths."""
        mesh, line = self.mesh, self.problem.line
        supports = np.array([own.stiffness for own in line.supports])[mesh.support_group]
        self.standing = self.wires + self._diagonal(mesh.supports, supports)
        load = np.zeros(self.size)
        for number, own in enumerate(line.supports):
            nodes = mesh.supports[mesh.support_group == number]
            load[self.w[nodes]] += own.stiffness * line.wire(own.wire).points(mesh.x(nodes))[:, 2]
        for (upper, lower), number in zip(mesh.clamps, line.clamp_group, strict=True):
            at, k = self.w[[upper, lower]], line.clamps[number].stiffness
            self.standing = self.standing + sparse.csc_matrix(
                ([k, -k, -k, k], (at[[0, 0, 1, 1]], at[[0, 1, 0, 1]])), shape=(self.size, self.size)
            )
        wanted, held = self._wanted()
        n, m = len(mesh.droppers), len(held)
        given = np.append(self.w[mesh.droppers[:, 1]], self.w[held])
        pick = sparse.csr_matrix((np.ones(n + m), (np.arange(n + m), given)),
                                 shape=(n + m, self.size))  # fmt: skip
        acts = sparse.vstack([-self.pull, pick[n:]]).T
        factor = sparse_linalg.splu(sparse.bmat([[self.standing, -acts], [pick, None]]).tocsc())
        length = mesh.points[mesh.droppers[:, 0], 2] - mesh.points[mesh.droppers[:, 1], 2]
        gravity = simulated(self.problem).gravity
        for _ in range(8):
            self.hung, self.moved = self._points(length)
            right = load - gravity * (self.wire_weight + self.hung)
            found = factor.solve(np.append(right, wanted))
            self.tension = found[self.size : self.size + n]
            length = self.pull @ found[: self.size] - self.tension / self.spring
        self.height = found[: self.size]

    def _wanted(self) -> tuple[np.ndarray, np.ndarray]:
        """Heights wanted at droppers' lower ends, at ends and at arms that hold them, and the nodes
        of the latter two."""
        mesh, line, laws = self.mesh, self.problem.line, simulated(self.problem)
        at_droppers = np.zeros(len(mesh.droppers))
        for number, group in enumerate(line.droppers):
            mine = mesh.dropper_group == number
            at_droppers[mine] = laws.target_height(
                line.wire(group.lower), mesh.x(mesh.droppers[mine, 1])
            )
        held, heights = [], [at_droppers]
        for wire in line.wires:
            held.append(mesh.anchors[np.isin(mesh.anchors, mesh.wires[wire.name])])
            ends = wire.held_heights if wire.profile is None else laws.target_height(
                wire, mesh.x(held[-1]))  # fmt: skip
            heights.append(np.array(ends, dtype=float))
        for number, arms in enumerate(line.steady_arms):
            if arms.kind.holds_height:
                held.append(mesh.steady_arms[mesh.arm_group == number])
                heights.append(laws.target_height(line.wire(arms.wire), mesh.x(held[-1])))
        return np.concatenate(heights), np.concatenate(held)

    def _points(self, length: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Point masses that hang at each unknown, and those that move with it [kg]."""
        mesh, line = self.mesh, self.problem.line
        hung = np.zeros(self.size)
        for number, group in enumerate(line.droppers):
            mine = mesh.dropper_group == number
            half = 0.5 * group.kind.mass_per_length * length[mine]
            for side, clamp in ((0, group.kind.upper_clamp_mass), (1, group.kind.lower_clamp_mass)):
                np.add.at(hung, self.w[mesh.droppers[mine, side]], half + clamp)
        for (upper, lower), number in zip(mesh.clamps, line.clamp_group, strict=True):
            hung[self.w[[upper, lower]]] += 0.5 * line.clamps[number].mass
        moved = hung.copy()
        for number, arms in enumerate(line.steady_arms):
            at = self.w[mesh.steady_arms[mesh.arm_group == number]]
            rod = arms.kind.mass_per_length * arms.kind.length
            np.add.at(hung, at, rod / 2 + arms.kind.clamp_mass)
            np.add.at(moved, at, rod / 3 + arms.kind.clamp_mass)
        return hung, moved

    def _moving(self) -> None:
        """Matrices of the motion, all droppers taut; held unknowns are left out."""
        mesh, line = self.mesh, self.problem.line
        arms = np.array([own.kind.stiffness for own in line.steady_arms])[mesh.arm_group]
        stiffness = self.standing + self._diagonal(mesh.steady_arms, arms)
        stiffness = stiffness + self.pull.T @ sparse.diags(self.spring) @ self.pull
        self.free = np.setdiff1d(np.arange(self.size), self.w[mesh.anchors])
        cut = sparse.csr_matrix(
            (np.ones(self.free.size), (np.arange(self.free.size), self.free)),
            shape=(self.free.size, self.size),
        )
        self.stiffness = (cut @ stiffness @ cut.T).tocsr()
        self.inertia = (cut @ (self.mass + sparse.diags(self.moved)) @ cut.T).tocsr()
        self.pulls = (self.pull @ cut.T).tocsr()
        self.number = np.full(self.size, -1)
        self.number[self.free] = np.arange(self.free.size)

    def _banded(self, matrix: sparse.spmatrix) -> tuple[np.ndarray, bool]:
        """Cholesky factors of a matrix in bands."""
        lower = sparse.tril(matrix).tocoo()
        bands = np.zeros((int((lower.row - lower.col).max()) + 1, matrix.shape[0]))
        bands[lower.row - lower.col, lower.col] = lower.data
        return linalg.cholesky_banded(bands, lower=True), True

    def at(self, wire: str, x: float) -> tuple[np.ndarray, np.ndarray, float]:
        """How the height of a wire at a place follows from the free unknowns, as numbers and
        weights, and its height at rest [m]."""
        nodes = self.mesh.wires[wire]
        places = self.mesh.points[nodes, 0]
        e = min(max(int(np.searchsorted(places, x, side="right")) - 1, 0), len(places) - 2)
        h = places[e + 1] - places[e]
        own = np.repeat(self.w[nodes[e : e + 2]], 2) + [0, 1, 0, 1]
        values = cubics(np.array((x - places[e]) / h), np.array(h))
        rest = float(values @ self.height[own])
        keep = self.number[own] >= 0
        return self.number[own[keep]], values[keep], rest

    def _unknowns_up_to(self, x: float) -> int:
        """How many free unknowns there are up to a place [m]."""
        last = np.searchsorted(self.sorted_x, x, side="right")
        return int(np.searchsorted(self.free, 2 * last))

    def elasticity(self, start: float, end: float) -> tuple[np.ndarray, np.ndarray]:
        """Places of nodes between two masts (n,) [m], and the lift there under a unit force that
        the contact wires share [m/N]."""
        x = self._nodes(start, end)
        return x, self._lift(x)

    def _nodes(self, start: float, end: float) -> np.ndarray:
        """Places of the contact wire's nodes between two masts (n,) [m]."""
        wire = self.problem.line.wires_of(Role.CONTACT)[0]
        x = self.mesh.points[self.mesh.wires[wire.name], 0]
        return np.asarray(x[(x > start - 1e-9) & (x < end + 1e-9)])

    def _lift(self, places: np.ndarray) -> np.ndarray:
        """Lift under a unit force that the contact wires share, (n,) [m/N]."""
        factor, wires = self._banded(self.stiffness), self.problem.line.wires_of(Role.CONTACT)
        lifts = []
        for place in places:
            load = np.zeros(self.free.size)
            for wire in wires:
                own, values, _ = self.at(wire.name, place)
                load[own] += values / len(wires)
            lifts.append(load @ linalg.cho_solve_banded(factor, load))
        return np.array(lifts)

    def nominal_height(self, start: float, end: float) -> float:
        """Mean height between two masts of a head that presses with its static force [m], by two
        Gauss points an element: trapezoids between nodes miss how the wire bends within it."""
        x, wire = self._nodes(start, end), self.problem.line.wires_of(Role.CONTACT)[0].name
        half = np.repeat(np.diff(x) / 2, 2)
        places = np.repeat(x[:-1], 2) + half * (1 + np.tile([-1, 1], x.size - 1) / np.sqrt(3))
        height = np.array([self.at(wire, place)[2] for place in places])
        height += self._lift(places) * self.problem.train.placements[0].static_force
        return float(half @ height / (end - start))

    def run(self, nominal_height: float) -> History:
        """The train's way to its end, by average acceleration."""
        problem, dt = self.problem, self.problem.numerics.dt
        train, alpha, beta = problem.train, problem.damping.alpha, problem.damping.beta
        # A = M + dt/2 C + dt^2/4 K = mu M + kappa K.
        mu, kappa = 1.0 + dt / 2 * beta, dt**2 / 4 + dt / 2 * alpha
        answers = _Answers(self._banded(mu * self.inertia + kappa * self.stiffness)[0], self.pulls)
        wires = [wire.name for wire in problem.line.wires_of(Role.CONTACT)]
        law = problem.contact.stiffness  # type: ignore[union-attr]
        behind = np.array([own.behind for own in train.placements])
        heads = [_Chain(own.data, own.static_force, dt) for own in train.placements]  # type: ignore[arg-type]
        for head, start in zip(heads, train.start - behind, strict=True):
            head.begin(np.mean([self.at(wire, start)[2] for wire in wires]), nominal_height)
        # Contacts, head by head, and which of them are of one head.
        n = len(heads) * len(wires)
        of = np.repeat(np.arange(len(heads)), len(wires))
        # Displacement, velocity and acceleration of the first m unknowns; the others are at rest.
        state, m, front = np.zeros((3, self.free.size)), 0, train.start
        d, v, a = state[:, :m]
        worth = self.spring * kappa
        one_sided = _OneSided(law, worth, n, dt, answers)
        arms = self.mesh.steady_arms
        x = self.mesh.points[arms, 0]
        arms = arms[(x >= problem.evaluation[0]) & (x <= problem.evaluation[1])]
        arm_numbers, uplift = self.number[self.w[arms]], 0.0
        n_steps = int((train.end - train.start) / train.speed / dt + 1e-9)
        record = np.zeros((3, n_steps, len(heads)))
        for step in range(n_steps):
            time = (step + 1) * dt
            places = train.start + train.speed * time - behind
            if step % _LOOK_EVERY == 0 and m < self.free.size:
                near = self._unknowns_up_to(front - _WAY)
                if not m or np.abs(d[near:]).max() > _AT_REST:
                    front += 3.0 * _WAY
                    state[2, :m], m = a, self._unknowns_up_to(front)
                    d, v, a = state[:, :m]
                    inertia = self.inertia[:m, :m]
            # Before the step's own acceleration.
            d += dt * v
            d += dt**2 / 4 * a
            v += dt / 2 * a
            # a = -A^-1 (K moved + beta M v), where K is (A - mu M) / kappa.
            moved = (d + alpha * v) / kappa
            free = answers.whole(inertia @ (mu * moved - beta * v))
            tension = self.tension + worth * answers.stretch(free)
            free -= moved
            contacts = [self.at(wire, place) for place in places for wire in wires]
            columns = [answers.under(own, values) for own, values, _ in contacts]
            height = [r + values @ (d[own] + dt**2 / 4 * free[own]) for own, values, r in contacts]
            lifts = np.array([head.predict(time, train.raise_time) for head in heads])
            give = lifts[of, 1] * (of[:, None] == of)
            depth = lifts[of, 0] - height
            found = one_sided.forces(depth, tension, contacts, columns, give)
            a, felt = free, np.zeros(len(heads))
            for number, column, force in found:
                there = a[column.first :][: column.values.size]
                there += force * column.values[: there.size]
                if number < n:
                    felt[of[number]] += force
            d += dt**2 / 4 * a
            v += dt / 2 * a
            for head, force in zip(heads, felt, strict=True):
                head.follow(force)
            lines = contacts[:: len(wires)]
            record[:, step] = places, felt, [rest + values @ d[own] for own, values, rest in lines]
            uplift = max(uplift, float(_within(0, d, arm_numbers).max()))
        place, force, height = record
        return History(dt, place, force, uplift, height)


@dataclass
class _Column:
    """The part of A^-1 b that is not zero, from an unknown on, and how it stretches droppers."""

    first: int
    values: np.ndarray
    stretch: np.ndarray

    def at(self, numbers: np.ndarray, weights: np.ndarray) -> float:
        """The weighted sum of its values of unknowns in ascending order."""
        if numbers[-1] < self.first or numbers[0] >= self.first + self.values.size:
            return 0.0
        return float(weights @ _within(self.first, self.values, numbers))


def _within(first: int, values: np.ndarray, numbers: np.ndarray) -> np.ndarray:
    there = (numbers >= first) & (numbers < first + values.size)
    return np.where(there, values[np.where(there, numbers - first, 0)], 0.0)


class _Answers:
    """Solutions by Cholesky factors in bands, of loads on few unknowns where they matter."""

    def __init__(self, factor: np.ndarray, pulls: sparse.csr_matrix) -> None:
        self.factor = np.asfortranarray(factor)
        self.pulls, self.reach = pulls, 400
        pulls.sort_indices()
        self.size = factor.shape[1]
        # Unknowns of each dropper, and their weights; -1 and zero where one end is held.
        self.ends, self.signs = np.full((2, pulls.shape[0]), -1), np.zeros((2, pulls.shape[0]))
        for side in (0, 1):
            there = np.diff(pulls.indptr) > side
            self.ends[side, there] = pulls.indices[pulls.indptr[:-1][there] + side]
            self.signs[side, there] = pulls.data[pulls.indptr[:-1][there] + side]
        self.of_droppers: dict[int, _Column] = {}

    def whole(self, load: np.ndarray) -> np.ndarray:
        """A^-1 load, of all unknowns up to one around which nothing moves."""
        return lapack.dpbtrs(self.factor[:, : load.size], load, lower=1, overwrite_b=True)[0]

    def stretch(self, values: np.ndarray, first: int = 0) -> np.ndarray:
        """How unknowns from a first one on stretch each dropper."""
        return np.sum(self.signs * _within(first, values, self.ends), axis=0)

    def of_dropper(self, number: int) -> _Column:
        """The answer to a unit force in a dropper."""
        if number not in self.of_droppers:
            there = self.ends[:, number] >= 0
            own = self.under(self.ends[there, number], self.signs[there, number])
            self.of_droppers[number] = own
        return self.of_droppers[number]

    def under(self, numbers: np.ndarray, load: np.ndarray) -> _Column:
        """The answer to a load on unknowns that are near each other. It fades within metres:
        unknowns around them are enough if at their ends nothing is left."""
        while True:
            first = max(int(numbers.min()) - self.reach, 0)
            last = min(int(numbers.max()) + self.reach, self.size)
            values = np.zeros(last - first)
            values[numbers - first] = load
            values = lapack.dpbtrs(self.factor[:, first:last], values, lower=1, overwrite_b=True)[0]
            near = 30
            ends = values[:near] if first else 0.0, values[-near:] if last < self.size else 0.0
            if max(np.abs(end).max() for end in ends) <= _NOTHING * np.abs(values).max():
                return _Column(first, values, self.stretch(values, first))
            self.reach *= 2


class _OneSided:
    """Forces of contacts that touch and of droppers that are slack, which counter their tension."""

    def __init__(self, law: float, worth: np.ndarray, n: int, dt: float, answers: _Answers) -> None:
        self.law, self.worth, self.n, self.dt, self.answers = law, worth, n, dt, answers
        # Contacts, then droppers: what is positive for those that touch, negative for slack ones.
        self.active = np.zeros(n + worth.size, dtype=bool)
        self.signs = np.repeat([1.0, -1.0], [n, worth.size])

    def forces(
        self,
        depth: np.ndarray,
        tension: np.ndarray,
        contacts: list[tuple[np.ndarray, np.ndarray, float]],
        columns: list[_Column],
        give: np.ndarray,
    ) -> list[tuple[int, _Column, float]]:
        """Number, answer of the line and force of each.

        Parameters
        ----------
        depth, tension : of contacts and droppers without any of these forces [m], [N]
        contacts, columns : places on the line, and what a unit force there does to it
        give : by how much a unit force on each contact lowers the head at each other (n, n) [m/N]
        """
        # f = law depth of contacts that touch, q = tension of droppers that are slack.
        alone = np.append(self.law * depth, tension)
        effects: dict[int, tuple[_Column, np.ndarray]] = {}
        for turn in range(_MOST_SWITCHES):
            on = np.flatnonzero(self.active)
            for k in on:
                if k not in effects:
                    column = columns[k] if k < self.n else self.answers.of_dropper(k - self.n)
                    less = [self.dt**2 / 4 * column.at(*place[:2]) for place in contacts]
                    lost = np.array(less) + (give[:, k] if k < self.n else 0.0)
                    effects[k] = column, np.append(-self.law * lost, self.worth * column.stretch)
            by = np.array([effects[k][1] for k in on]).reshape(on.size, alone.size).T
            forces = np.linalg.solve(np.eye(on.size) - by[on], alone[on])
            wrong = np.flatnonzero((self.signs * (alone + by @ forces) > 0) != self.active)
            if not wrong.size:
                return [(k, effects[k][0], f) for k, f in zip(on, forces, strict=True)]
            # All at first; should that go round, one at a time.
            self.active[wrong if turn < 20 else wrong[:1]] ^= True
        raise RuntimeError("signs do not fit")


class _Chain:
    """Lumped masses, head first, lifted at the last one; average acceleration."""

    def __init__(self, data: LumpedData, lift: float, dt: float) -> None:
        n = data.n_masses
        self.lift, self.dt, self.springs = lift, dt, data.stiffnesses
        self.mass = np.diag(data.masses)
        self.stiffness, self.damping = (
            sum(k * np.outer(r, r) for k, r in zip(values, self._stretches(n), strict=True))
            for values in (data.stiffnesses, data.dampings)
        )
        step = self.mass + dt / 2 * self.damping + dt**2 / 4 * self.stiffness
        self.inverse = np.linalg.inv(step)

    @staticmethod
    def _stretches(n: int) -> np.ndarray:
        """Stretch of each spring by the masses' heights; the last stands on the base."""
        return np.eye(n) - np.eye(n, k=1)

    def begin(self, height: float, nominal_height: float) -> None:
        """All masses at a height; the base spring is relaxed when the head is at the nominal one
        under the static force."""
        n = len(self.mass)
        self.base = self.springs[-1] * (
            nominal_height + sum(self.lift / k for k in self.springs[:-1])
        )
        # Before anything lifts it, the base spring alone pushes the last mass.
        level = np.full(n, height)
        push = -self.stiffness @ level
        push[-1] += self.base
        self.state = np.array([level, np.zeros(n), push / np.diag(self.mass)])

    def predict(self, time: float, raise_time: float) -> tuple[float, float]:
        """Height of the head at a time without contact [m], and how far a unit force lowers it."""
        dt = self.dt
        z, v, a = self.state
        self.z, self.v = z + dt * v + dt**2 / 4 * a, v + dt / 2 * a
        part = 0.5 * (1.0 - np.cos(np.pi * min(time / raise_time, 1.0)))
        load = -self.damping @ self.v - self.stiffness @ self.z
        load[-1] += part * self.lift + self.base
        self.free = self.inverse @ load
        return self.z[0] + dt**2 / 4 * self.free[0], dt**2 / 4 * self.inverse[0, 0]

    def follow(self, force: float) -> None:
        """End the step under a contact force on the head, downward [N]."""
        dt, a = self.dt, self.free - force * self.inverse[:, 0]
        self.state = np.array([self.z + dt**2 / 4 * a, self.v + dt / 2 * a, a])
