"""A slack dropper carries nothing across it either: marches in three planes beside dense matrices,
from which all that a slack dropper adds is taken, with sets of slack droppers tried."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from itertools import combinations

import numpy as np
import pytest
from axial_lines import with_stiffness
from dense_line import hermite
from measuring import History, check, march, matrix_of
from small_lines import EN_PANTOGRAPH, WHOLE, ac_simple_line, mesh_of, numerics, problem_of, train
from studies import few

from catenary.meshgen.mesh import CONTACT_WIRE
from catenary.solver.problem.contact_laws import LinearLaw
from catenary.solver.problem.problem import Damping, Problem
from catenary.solver.statics.form_finding import find_form

ALPHA = 2e-4
PLANES = {"lateral": {"lateral_motion"}, "three": {"lateral_motion", "axial_motion"}}


def scene(effects: set[str], scheme: str = "one_solve") -> Problem:
    """Two spans with few droppers that lean, and a head that lifts the wire off them."""
    line = replace(
        ac_simple_line(2),
        dropper_positions=((13.75, 41.25),) * 2,
        pre_sag=((0.02, 0.02),) * 2,
        stagger=(0.3, -0.3, 0.3),
        messenger_stagger=(-0.2, 0.2, -0.2),
    )
    line = replace(line, steady_arm=replace(line.steady_arm, inclination=np.deg2rad(10.0)))
    run = train(100.0, 10.0, 52.0, static_force=300.0, raise_time=0.0, nominal_height=5.06)
    return problem_of(
        with_stiffness(line),
        (WHOLE | effects) - {"contact_loss"},
        damping=Damping(ALPHA, 0.0),
        train=run,
        numerics=numerics(1e-3, scheme),
    )


class DenseDroppers:
    """The line's matrices without its droppers; these in every state, and two masses below."""

    def __init__(self, problem: Problem, wire_heads: np.ndarray) -> None:
        mesh = mesh_of_scene()
        model, form = find_form(problem, mesh)
        n = model.n_dofs
        self.size, self.rest_shape, self.mesh, self.model = n + 2, form, mesh, model
        mass, damping, stiffness = np.zeros((3, self.size, self.size))
        mass[:n, :n] = matrix_of(model, mass=1.0).toarray()
        stiffness[:n, :n] = matrix_of(model, stiffness=1.0).toarray()
        damping[:n, :n] = ALPHA * stiffness[:n, :n]
        (k1, k2), (c1, c2) = EN_PANTOGRAPH.stiffnesses, EN_PANTOGRAPH.dampings
        mass[n:, n:] = np.diag(EN_PANTOGRAPH.masses)
        stiffness[n:, n:] = [[k1, -k1], [-k1, k1 + k2]]
        damping[n:, n:] = [[c1, -c1], [-c1, c1 + c2]]
        self.matrices = mass, damping, stiffness
        place = problem.train.placements[0]
        assert place.nominal_height is not None
        self.load = np.zeros(self.size)
        self.load[-1] = place.static_force + k2 * (place.nominal_height + place.static_force / k1)
        self.free = np.setdiff1d(np.arange(self.size), model.constrained)
        self.dt = problem.numerics.dt
        assert isinstance(problem.contact, LinearLaw)
        self.law = problem.contact.stiffness
        # Of each dropper its direction, and what it adds to K: k along it, N / l across it.
        names = [name for name in ("u", "v", "w") if name in model.unknowns]
        assert form.lateral is not None
        along = form.along if form.along.size else np.zeros(mesh.n_nodes)
        places = {"u": mesh.points[:, 0] + along, "v": form.lateral.y, "w": form.height}
        self.pull, self.own = [], []
        for (upper, lower), force, k in zip(
            mesh.droppers, form.dropper_force, model.dropper_stiffness, strict=True
        ):
            vector = np.array([places[name][upper] - places[name][lower] for name in names])
            length = np.linalg.norm(vector)
            unit = vector / length
            both = np.zeros((len(names), self.size))
            for row, name in zip(both, names, strict=True):
                row[model.dofs(np.array([upper, lower]), name)] = 1.0, -1.0
            across = np.eye(len(names)) - np.outer(unit, unit)
            self.own.append(both.T @ (k * np.outer(unit, unit) + force / length * across) @ both)
            self.pull.append(unit @ both)
        self.force = form.dropper_force
        self.state, self.slack = np.zeros((3, self.size)), frozenset[int]()
        self.state[:, n:] = wire_heads

    def meets(self, x: float) -> tuple[np.ndarray, float]:
        nodes = self.mesh.wires[CONTACT_WIRE]
        at = self.mesh.points[nodes, 0]
        e = int(np.searchsorted(at, x)) - 1
        values = -np.array([f(x - at[e]) for f in hermite(at[e + 1] - at[e])])
        ends = nodes[[e, e, e + 1, e + 1]]
        direction = np.zeros(self.size)
        heights, slopes = ends[[0, 2]], ends[[1, 3]]
        direction[self.model.dofs(heights, "w")] = values[[0, 2]]
        direction[self.model.dofs(slopes, "theta_y")] = values[[1, 3]]
        rest = values[[0, 2]] @ self.rest_shape.height[heights]
        rest += values[[1, 3]] @ self.rest_shape.slope[slopes]
        direction[-2] = 1.0
        return direction, float(rest)

    def step(self, x: float) -> tuple[float, np.ndarray]:
        """Contact force and dropper forces [N] after a step of average acceleration."""
        dt, (mass, damping, stiffness) = self.dt, self.matrices
        d, v, a = self.state
        d, v = d + dt * v + dt**2 / 4 * a, v + dt / 2 * a
        direction, rest = self.meets(x)
        for slack in self._sets():
            k, c = stiffness.copy(), damping.copy()
            load = self.load - self.law * rest * direction
            k += self.law * np.outer(direction, direction)
            for number in slack:
                k -= self.own[number]
                c -= ALPHA * self.own[number]
                load += self.force[number] * self.pull[number]
            whole = (mass + dt / 2 * c + dt**2 / 4 * k)[np.ix_(self.free, self.free)]
            new = np.zeros(self.size)
            new[self.free] = np.linalg.solve(whole, (load - c @ v - k @ d)[self.free])
            d_new, v_new = d + dt**2 / 4 * new, v + dt / 2 * new
            stiff = self.model.dropper_stiffness
            stretch = np.array([pull @ (d_new + ALPHA * v_new) for pull in self.pull])
            tension = self.force + stiff * stretch
            if set(np.flatnonzero(tension < 0.0).tolist()) == slack:
                break
        else:
            raise AssertionError("no set of slack droppers fits its own signs")
        self.slack, self.state = slack, np.array([d_new, v_new, new])
        force = self.law * float(direction @ d_new + rest)
        return force, np.maximum(tension, 0.0)

    def _sets(self) -> Iterator[frozenset[int]]:
        for distance in range(len(self.pull) + 1):
            for other in combinations(range(len(self.pull)), distance):
                yield self.slack ^ frozenset(other)


def mesh_of_scene():  # type: ignore[no-untyped-def]
    return mesh_of(scene(set()).line, 3)


@cache
def marched(planes: str, scheme: str = "one_solve") -> History:
    def keep(view: object) -> object:
        return view.checkpoint()  # type: ignore[attr-defined]

    return march(scene(PLANES[planes], scheme), mesh_of_scene(), keep)


def sideways(seen: History) -> np.ndarray:
    """Lateral displacement where the head is going to be when droppers are slack [m]."""
    return np.array([state["displacement"] for state in seen.watched])


@pytest.mark.parametrize("planes", few(sorted(PLANES), "lateral"))
def test_a_march_is_that_of_matrices_without_slack_droppers(planes: str) -> None:
    problem, seen = scene(PLANES[planes]), marched(planes)
    heads = seen.watched[0]["pantograph_0"].reshape(3, 2)
    dense = DenseDroppers(problem, heads)
    found = [dense.step(x) for x in seen["contact_position"][1:, 0]]
    force, droppers = (np.array(part) for part in zip(*found, strict=True))
    slack = (droppers == 0.0).mean(axis=0)
    print(f"share of steps in which each dropper is slack: {slack}")
    assert slack.max() > 0.1
    check("contact force [N]", seen["contact_force"][1:, 0], force, within=1e-7)
    check("dropper forces [N]", seen["dropper_force"][1:], droppers, within=1e-7)
    moved = np.zeros(dense.model.n_dofs)
    state = seen.watched[-1]["displacement"].reshape(dense.mesh.n_nodes, -1)
    every = np.arange(dense.mesh.n_nodes)
    for column, name in enumerate(dense.model.unknowns):
        moved[dense.model.dofs(every, name)] = state[dense.model.row_of_node, column]
    check("motion at the end [m]", moved, dense.state[0, :-2], within=1e-10)


def test_schemes_agree_about_what_slack_droppers_leave_across() -> None:
    one, other = marched("lateral"), marched("lateral", "fixed_point")
    check("contact force [N]", other["contact_force"], one["contact_force"], within=1e-6)
    check("motion [m]", sideways(other), sideways(one), within=1e-9)
