"""Runs of hard cases, watched: histories, and the energy that the line gains beyond its input.

The work of the contact forces is summed as average acceleration does it: with forces f at places x
and the line's displacement u, a step does the work (f_n N(x_n) + f_n+1 N(x_n+1)) (u_n+1 - u_n) / 2.
With beta = 1/4 and gamma = 1/2 kinetic plus elastic energy then changes by that work less what
damping takes, exactly, as long as no dropper switches.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import spsolve

from catenary.cases.run.scene_mesh import mesh_of
from catenary.cases.scene.scene import Scene
from catenary.meshgen.mesh import CONTACT_WIRE, LineMesh
from catenary.solver.base.parallel import on_root
from catenary.solver.contact.contact_wire import ContactWire
from catenary.solver.integrators.make_line import make_line
from catenary.solver.model.model import Model, build, iterate_entries
from catenary.solver.model.partition import distribute
from catenary.solver.problem.incidents import in_steps
from catenary.solver.problem.problem import Problem
from catenary.solver.statics.equilibrium import (
    Elasticity,
    Equilibrium,
    elasticity,
    find_form,
    middle_span,
    stiffness_matrix,
)
from catenary.solver.time_loop.march import March
from catenary.solver.time_loop.observers import Stage, StepView

# Force under which a line is held before it is let go [N].
PULL = 200.0


@dataclass
class Watched:
    """A march as its observer on one rank saw it, or, on several, as rank 0 did.

    Attributes
    ----------
    outcome : "done", or the sentence of what broke
    time : (n,) [s]; position, force, height, wire : (n, n_pantographs) [m], [N], [m], [m]
    taut : (n, n_droppers) whether a dropper carries anything; only on one rank
    energy : (n,) of the line [J]; work : (n,) of the contact forces on it since the start [J];
        both empty unless asked for
    counters : of the scheme
    kept : by step, dropper forces [N] and the line's displacement as incidents found them
    """

    outcome: str = ""
    time: np.ndarray = field(default_factory=lambda: np.zeros(0))
    position: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))
    force: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))
    height: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))
    wire: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))
    taut: np.ndarray = field(default_factory=lambda: np.zeros((0, 0), dtype=bool))
    energy: np.ndarray = field(default_factory=lambda: np.zeros(0))
    work: np.ndarray = field(default_factory=lambda: np.zeros(0))
    counters: dict[str, int] = field(default_factory=dict)
    kept: dict[int, tuple[np.ndarray, np.ndarray]] = field(default_factory=dict)

    def energy_gain(self) -> float:
        """The most that energy less work rises above its least value before, of the largest energy.

        Damping lets it fall; what rises was given by nothing. After incidents the energy, which
        counts from the first rest, may be negative.
        """
        balance = self.energy - self.work
        rise = (balance - np.minimum.accumulate(balance)).max()
        return float(rise / max(np.abs(self.energy).max(), np.abs(self.work).max(), 1e-300))

    @property
    def all_finite(self) -> bool:
        """Whether everything that was recorded is a number."""
        values = (self.force, self.height, self.wire, self.energy, self.work)
        return all(bool(np.isfinite(each).all()) for each in values)

    def switches(self) -> np.ndarray:
        """Droppers that slackened or tightened in each step, shape (n - 1,)."""
        return np.asarray((self.taut[1:] != self.taut[:-1]).sum(axis=1))


class Watcher:
    """Observer that keeps what `Watched` holds; ``wire`` is needed for the work.

    With the work, dropper forces and displacements are kept after the steps ``keep``.
    """

    def __init__(self, wire: ContactWire | None = None, keep: Collection[int] = ()) -> None:
        self._wire = wire
        self._keep = keep
        self._kept: dict[int, tuple[np.ndarray, np.ndarray]] = {}
        self._rows: dict[str, list[Any]] = {
            name: [] for name in ("time", "position", "force", "height", "wire", "taut")
        }
        self._energy: list[float] = []
        self._work: list[float] = []
        self._before = np.zeros(0)
        self._pushed: list[tuple[np.ndarray, np.ndarray]] = []

    def start(self, stage: Stage) -> None:
        """Nothing is needed of the stage."""

    def observe(self, view: StepView) -> None:
        """Collective if the work is wanted."""
        for name, value in (
            ("time", view.time),
            ("position", view.contact_position.copy()),
            ("force", view.contact_force.copy()),
            ("height", view.head_height.copy()),
            ("wire", view.wire_height.copy()),
            ("taut", view.dropper_force > 0.0),
        ):
            self._rows[name].append(value)
        if self._wire is not None:
            self._energy.append(sum(view.energies()))
            self._add_work(view, self._wire)

    def finish(self, outcome: str) -> None:
        """Nothing is left to do."""

    def watched(self, outcome: str, counters: dict[str, int]) -> Watched:
        """All that was seen."""
        rows = {name: np.array(values) for name, values in self._rows.items()}
        energies = np.array(self._energy), np.array(self._work)
        return Watched(
            outcome,
            **rows,
            energy=energies[0],
            work=energies[1],
            counters=counters,
            kept=self._kept,
        )

    def _add_work(self, view: StepView, wire: ContactWire) -> None:
        state = view.checkpoint()
        assert state is not None  # the work is only asked for on one rank
        displacement = state["displacement"]
        touches = wire.touches(view.contact_position)
        ends = touches["element"][:, None] + np.array([0, 1])
        dofs = wire.dofs[ends].reshape(-1, 4)
        pushed = [(dofs.ravel(), (view.contact_force[:, None] * touches["whole_value"]).ravel())]
        done = self._work[-1] if self._work else 0.0
        if self._before.size:
            for where, values in (*self._pushed, *pushed):
                done += 0.5 * float(values @ (displacement[where] - self._before[where]))
        self._work.append(done)
        if view.step in self._keep:
            self._kept[view.step] = view.dropper_force.copy(), displacement.copy()
        self._before, self._pushed = displacement.copy(), pushed


@dataclass
class AtRest:
    """A scene's problem with its line in equilibrium, on all ranks."""

    problem: Problem
    model: Model
    form: Equilibrium
    lift: Elasticity

    def cut(self) -> float:
        """Where the boundary between two ranks lies [m]: the last node that the first one owns."""
        nodes = self.model.mesh.wires[CONTACT_WIRE]
        mine = distribute(self.model, 2, 0).owned(self.model.dofs(nodes))
        return float(self.model.mesh.x(nodes[mine]).max())

    def rest_height(self, x: np.ndarray) -> np.ndarray:
        """Height of the contact wire at rest at places ``x`` [m], shape as ``x``."""
        wire = ContactWire(self.model, self.form, distribute(self.model, 1, 0))
        return wire.rest_height(x.ravel()).reshape(x.shape)

    def node_places(self) -> np.ndarray:
        """Places of the contact wire's nodes [m]."""
        return np.asarray(self.model.mesh.x(self.model.mesh.wires[CONTACT_WIRE]))


def at_rest(scene: Scene, comm: Any) -> AtRest:
    """The line of a scene in equilibrium, found on rank 0 and given to all. Collective."""
    problem = scene.to_problem()

    def make() -> tuple[LineMesh, np.ndarray, Equilibrium, Elasticity]:
        mesh = mesh_of(scene)
        model, form = find_form(problem, mesh)
        return mesh, model.dropper_lengths, form, elasticity(model, *middle_span(problem.line))

    mesh, lengths, form, lift = on_root(comm, make)
    return AtRest(problem, build(problem, mesh, lengths), form, lift)


def run(rest: AtRest, comm: Any, with_work: bool = False) -> Watched:
    """March to the end, or to where it breaks. Collective; ``with_work`` on one rank only."""
    wire = ContactWire(rest.model, rest.form, distribute(rest.model, 1, 0)) if with_work else None
    problem = rest.problem
    keep = [happened.step for happened in in_steps(problem.incidents, problem.numerics.dt)]
    watcher = Watcher(wire, keep)
    with March(comm, rest.problem, rest.model, rest.form, rest.lift) as march:
        ended = march.run([watcher])
    return watcher.watched(ended.outcome, ended.counters)


def run_free(rest: AtRest, comm: Any, n_steps: int) -> Watched:
    """Energy of a line that is let go from under a force at its middle; no train. Collective.

    The acceleration at the start is the one that belongs to the shape: M a = -K u.
    """
    model, numerics = rest.model, rest.problem.numerics
    nodes = model.mesh.wires[CONTACT_WIRE]
    load = np.zeros(model.n_dofs)
    load[model.dofs(nodes[nodes.size // 2])] = PULL
    stiffness = stiffness_matrix(model)
    shape = spsolve(stiffness, load)
    acceleration = spsolve(_mass_matrix(model), -load)
    ownership = distribute(model, comm.size, comm.rank)
    rows = slice(ownership.first, ownership.last)
    line = make_line(comm, model, ownership, numerics)
    try:
        line.start(shape[rows], np.zeros(ownership.n_local), acceleration[rows])
        energy = [sum(line.energies())]
        every = max(1, n_steps // 100)
        for number in range(1, n_steps + 1):
            line.free_step()
            if number % every == 0:
                energy.append(sum(line.energies()))
    finally:
        line.destroy()
    values = np.array(energy)
    return Watched("done", energy=values, work=np.zeros_like(values), counters={"steps": n_steps})


def _mass_matrix(model: Model) -> csc_matrix:
    """M with ones at the unknowns that are held, which then have no acceleration."""
    n, held = model.n_dofs, model.constrained
    parts = list(iterate_entries(model, 0, n, 1.0, 0.0, 0.0))
    rows, columns, values = (np.concatenate(part) for part in zip(*parts, strict=True))
    rows, columns = np.concatenate([rows, held]), np.concatenate([columns, held])
    return csc_matrix((np.concatenate([values, np.ones(held.size)]), (rows, columns)), shape=(n, n))
