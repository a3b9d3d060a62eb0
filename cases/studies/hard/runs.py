"""Runs of hard cases, watched: histories, and the energy that the line gains beyond its input.

The energy is that of Newmark's balance, `LineBalance`: the method has a balance of its own (S.
Krenk, Comput. Methods Appl. Mech. Engrg. 195 (2006) 6110-6124), in which numerical damping only
takes. Contact forces and gusts are loads in it, whose work is summed with the method's weights. So
contact that is lost or regained makes no energy, however the force jumps, and what rises was made
by droppers that switch, at most `RunHistories.one_switch` each.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.linalg import spsolve

from catenary.base.errors import RunBroken
from catenary.base.parallel import on_root
from catenary.cases.run.scene_mesh import mesh_of
from catenary.cases.scene.scene import Scene, problem_of
from catenary.postproc.record.run_watch import RunWatch
from catenary.solver.contact.contact_wire import ContactWires
from catenary.solver.integrators.line_integrator import make_line
from catenary.solver.integrators.line_loads import LineLoads
from catenary.solver.linear.line_products import Subdomain
from catenary.solver.model.link_directions import swings_of_droppers
from catenary.solver.model.links import Direction
from catenary.solver.model.loads import MemoryLoad
from catenary.solver.model.matrices import stiffness_matrix, whole_matrix
from catenary.solver.model.model import Model
from catenary.solver.model.partition import distribute
from catenary.solver.problem.contact_laws import KinematicLaw
from catenary.solver.problem.defects import in_steps
from catenary.solver.problem.problem import Problem
from catenary.solver.statics.line_at_rest import LineAtRest, line_at_rest_on_all
from catenary.solver.time_loop.march import March
from catenary.solver.time_loop.views.observers import NEVER, Observer, StepView

# Force under which a line is held before it is let go [N].
PULL = 200.0
# Steps whose states are kept until the work done in them is summed.
_BLOCK = 100
_MOTION = ("displacement", "velocity", "acceleration")


@dataclass
class RunHistories:
    """A march as its observer on one rank saw it, or, on several, as rank 0 did.

    Attributes
    ----------
    outcome : "done", or the sentence of what broke
    time : (n,) [s]
    position, force, height, wire : (n, n_pantographs) place of the contact [m], contact force [N],
        heights of head and wire [m]
    on_wires : (n, n_pantographs n_wires) force on each contact wire [N]; no columns with one wire
    stops : (n, n_stops) whether a stop is closed
    taut : (n, n_droppers) whether a dropper carries a force; only on one rank
    energy : (n,) energy of the line [J]; empty without ``with_work``
    work : (n,) work of contact forces and gusts on the line since the start [J]; empty likewise
    terms : (n,) terms of numerical damping and of slack droppers' transverse stiffness that the
        balance adds to the energy [J], see `LineBalance`; empty likewise
    one_switch : largest energy that one dropper may have made in one switch [J], see `LineBalance`
    counters : counters of the scheme
    kept : by step, dropper forces [N] and the line's displacement right before an incident
    remarks : sentences of a run's own watch, see `RunWatch`; none without one
    """

    outcome: str = ""
    time: np.ndarray = field(default_factory=lambda: np.zeros(0))
    position: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))
    force: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))
    height: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))
    wire: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))
    on_wires: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))
    stops: np.ndarray = field(default_factory=lambda: np.zeros((0, 0), dtype=bool))
    taut: np.ndarray = field(default_factory=lambda: np.zeros((0, 0), dtype=bool))
    energy: np.ndarray = field(default_factory=lambda: np.zeros(0))
    work: np.ndarray = field(default_factory=lambda: np.zeros(0))
    terms: np.ndarray = field(default_factory=lambda: np.zeros(0))
    one_switch: float = 0.0
    counters: dict[str, int] = field(default_factory=dict)
    kept: dict[int, tuple[np.ndarray, np.ndarray]] = field(default_factory=dict)
    remarks: list[str] = field(default_factory=list)

    def energy_gain(self, besides: Collection[int] = ()) -> float:
        """Largest rise of energy less work above an earlier value, over the largest energy [-].

        Damping only lowers it; any rise is spurious. After incidents the energy, which counts from
        the first rest, may be negative. Changes in the steps from ``besides`` are left out.
        """
        balance = self.energy - self.work
        if self.terms.size:
            balance = balance + self.terms
        if besides:
            changes = np.diff(balance)
            changes[[step for step in besides if step < changes.size]] = 0.0
            balance = np.concatenate([[0.0], np.cumsum(changes)])
        rise = (balance - np.minimum.accumulate(balance)).max()
        return float(rise / self.energy_scale())

    def energy_scale(self) -> float:
        """The largest energy or work of the run [J]."""
        return float(max(np.abs(self.energy).max(), np.abs(self.work).max(), 1e-300))

    @property
    def all_finite(self) -> bool:
        """Whether everything that was recorded is a number."""
        values = (self.force, self.height, self.wire, self.energy, self.work)
        return all(bool(np.isfinite(each).all()) for each in values)

    def switches(self) -> np.ndarray:
        """Droppers that slackened or tightened in each step, shape (n - 1,)."""
        return np.asarray((self.taut[1:] != self.taut[:-1]).sum(axis=1))


def at_rest(scene: Scene, comm: Any) -> LineAtRest:
    """The line of a scene in equilibrium, on all ranks. Collective."""
    return line_at_rest_on_all(problem_of(scene), on_root(comm, lambda: mesh_of(scene)), comm)


def cut_of(rest: LineAtRest) -> float:
    """Place of the boundary between two ranks [m]: the last node that the first one owns."""
    nodes = rest.model.contact_nodes
    mine = distribute(rest.model, 2, 0).owned(rest.model.dofs(nodes))
    return float(rest.mesh.x(nodes[mine]).max())


def rest_height(rest: LineAtRest, x: np.ndarray) -> np.ndarray:
    """Height of the contact wire at rest at places ``x`` [m], shape as ``x``."""
    wire = ContactWires(rest.model, rest.form, distribute(rest.model, 1, 0))
    return wire.rest_height(x.ravel()).reshape(x.shape)


def run(
    rest: LineAtRest, comm: Any, with_work: bool = False, self_watched: bool = False
) -> RunHistories:
    """March to the end, or to where it breaks. Collective; ``with_work`` on one rank only.

    ``self_watched``: judged by the watch of all runs as well, which does not end it here.
    """
    wire = ContactWires(rest.model, rest.form, distribute(rest.model, 1, 0)) if with_work else None
    simulated = rest.model.simulated
    balance = LineBalance(rest.model, rest.problem, rest.form.dropper_force) if with_work else None
    keep = [happened.step for happened in in_steps(simulated.incidents, rest.problem.numerics.dt)]
    watcher = Watcher(wire, keep, balance)
    watch = _EndlessWatch(comm, rest)
    with March(comm, *rest) as march:
        ended = march.run([watcher, watch] if self_watched else [watcher])
    found = watcher.histories(ended.outcome, ended.counters)
    found.remarks = watch.remarks
    return found


def run_free(rest: LineAtRest, comm: Any, n_steps: int) -> RunHistories:
    """Energy of a line that is let go from under a force at its middle, over ``n_steps``; no train.
    Collective.

    The acceleration at the start is the one that belongs to the shape: M a = -K u.
    """
    model, numerics = rest.model, rest.problem.numerics
    nodes = model.contact_nodes
    load = np.zeros(model.n_dofs)
    load[model.dofs(nodes[nodes.size // 2])] = PULL
    stiffness = stiffness_matrix(model)
    shape = spsolve(stiffness, load)
    acceleration = spsolve(whole_matrix(model, mass=1.0, held_diagonal=1.0), -load)
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
    return RunHistories(
        "done", energy=values, work=np.zeros_like(values), counters={"steps": n_steps}
    )


class Watcher(Observer):
    """Observer that keeps what `RunHistories` holds; wire and balance are needed for the work.

    With the work, dropper forces and displacements are kept after the steps ``keep``. Steps are
    then looked at one by one, otherwise in blocks of rows.
    """

    def __init__(
        self,
        wire: ContactWires | None = None,
        keep: Collection[int] = (),
        balance: LineBalance | None = None,
    ) -> None:
        self._wire = wire
        self._balance = balance
        self._keep = keep
        self._kept: dict[int, tuple[np.ndarray, np.ndarray]] = {}
        self._columns: dict[str, slice] = {}
        self._rows: list[np.ndarray] = []
        self._times: list[np.ndarray] = []
        self._energy: list[float] = []
        self._states: list[tuple[np.ndarray, ...]] = []
        self._work = np.zeros(0)
        self._terms = np.zeros(0)
        self._one_switch = 0.0
        self._latest = np.zeros(0)

    def next_state(self, step: int) -> int:
        """Every state if the work is wanted, otherwise none."""
        return step + 1 if self._balance is not None else NEVER

    def observe(self, view: StepView) -> None:
        """Collective if the work is wanted."""
        self._columns = view.columns
        self._times.append(view.times.copy())
        self._rows.append(view.rows.copy())
        if self._balance is not None:
            self._energy.append(sum(view.energies()))
            state = view.line_state()
            self._states.append(tuple(state[name].copy() for name in _MOTION))
            if view.step in self._keep:
                self._kept[view.step] = view.dropper_force.copy(), self._states[-1][0]
            if len(self._states) > _BLOCK:
                self._add_work()

    def histories(self, outcome: str, counters: dict[str, int]) -> RunHistories:
        """Return the record of the march."""
        if self._states:
            self._add_work()
        return RunHistories(
            outcome,
            time=np.concatenate(self._times),
            position=self._channel("contact_position"),
            force=self._channel("contact_force"),
            height=self._channel("head_height"),
            wire=self._channel("wire_height"),
            on_wires=self._channel("contact_wire_force"),
            taut=self._channel("dropper_force") > 0.0,
            stops=self._channel("stop_force") > 0.0,
            energy=np.array(self._energy),
            work=self._work,
            terms=self._terms,
            one_switch=self._one_switch,
            counters=counters,
            kept=self._kept,
        )

    def _channel(self, name: str, last: int = 0) -> np.ndarray:
        """Values of a channel after all steps, or after the ``last`` of them, (n, width)."""
        return np.concatenate([rows[:, self._columns[name]] for rows in self._rows[-last:]])

    def _add_work(self) -> None:
        """Take the states kept so far into account; the last one begins the next block."""
        wire, balance = self._wire, self._balance
        assert wire is not None and balance is not None
        k, seen = len(self._states), self._work.size
        states = dict(zip(_MOTION, map(np.array, zip(*self._states, strict=True)), strict=True))
        several = wire.n_wires > 1
        force = self._channel("contact_wire_force" if several else "contact_force", k)
        if balance.recorded_means:
            force = self._behind_means(force, balance.weights)
        place = np.repeat(self._channel("contact_position", k), wire.n_wires, axis=1).ravel()
        touches = wire.touches(place, np.arange(place.size) % wire.n_wires)
        elements = touches["element"][:, None] + np.array([0, 1])
        dofs = wire.dofs[elements].reshape(k, -1)
        pushed = (force.reshape(-1, 1) * touches["whole_value"]).reshape(k, -1)
        moved = np.diff(states["displacement"], axis=0)
        done = np.zeros(k)
        for weight, part in zip(balance.weights, (slice(None, -1), slice(1, None)), strict=True):
            done[1:] += weight * (pushed[part] * np.take_along_axis(moved, dofs[part], 1)).sum(1)
        done[1:] += balance.work_of_loads(np.concatenate(self._times)[-k:], moved)
        taut = self._channel("dropper_force", k) > 0.0
        lacks, left = balance.across(states, taut)
        done[1:] += left
        done[0] = self._work[-1] if seen else 0.0
        switched = taut[1:] != taut[:-1]
        self._one_switch = max(
            self._one_switch, balance.one_switch(states["velocity"][1:], switched)
        )
        stopped = self._channel("stop_force", k) > 0.0
        pushed_off = stopped[1:] != stopped[:-1]
        one_stop = balance.one_stop(states["velocity"][1:], pushed_off)
        self._one_switch = max(self._one_switch, one_stop)
        again = min(seen, 1)  # the first state ended the block before
        self._work = np.append(self._work, np.cumsum(done)[again:])
        terms = balance.damping_terms(states, taut) + lacks
        self._terms = np.append(self._terms, terms[again:])
        del self._states[:-1]

    def _behind_means(self, means: np.ndarray, weights: tuple[float, float]) -> np.ndarray:
        """Forces (k, n) at the ends of steps whose weighted means over the steps are given [N].

        The first is the last one found before; a run begins without force.
        """
        forces = np.zeros_like(means)
        if self._latest.size:
            forces[0] = self._latest
        for i in range(1, len(means)):
            forces[i] = (means[i] - weights[0] * forces[i - 1]) / weights[1]
        self._latest = forces[-1].copy()
        return forces


class _EndlessWatch(RunWatch):
    """The watch of all runs; what would end a run is a remark, so that more can be measured."""

    _ended = False

    def observe(self, view: StepView) -> None:
        """Look at steps, unless a run would have ended before. Collective."""
        if self._ended:
            return
        try:
            super().observe(view)
        except RunBroken as broken:
            self._ended = True
            self.remarks.append(f"A run would end here: {broken}.")


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
        self._slack = [("velocity", of_velocity), ("acceleration", dt**2 * excess * of_velocity)]
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
