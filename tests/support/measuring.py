"""What tests measure with: checks that print what they compare, matrices, marches, orders."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from mpi4py import MPI
from scipy import sparse
from scipy.sparse import linalg as sparse_linalg

from catenary.meshgen.mesh import LineMesh
from catenary.solver.effects.all_effects import registry
from catenary.solver.effects.effect import Effect, register, unregister
from catenary.solver.integrators.line_integrator import LineIntegrator, make_line
from catenary.solver.model.matrices import whole_matrix
from catenary.solver.model.model import Model
from catenary.solver.model.partition import distribute
from catenary.solver.model.rest_shape import Equilibrium
from catenary.solver.problem.problem import Numerics, Problem
from catenary.solver.statics.line_at_rest import line_at_rest
from catenary.solver.time_loop.march import March, Outcome
from catenary.solver.time_loop.views.observers import NEVER, Observer, Stage, StepView

COMM = MPI.COMM_WORLD


def check(what: str, observed: Any, expected: Any, *, within: Any) -> None:
    """Print observed and expected values and fail if they differ by more than ``within``.

    Arrays are compared entry by entry; what is printed is the entry that comes closest to its
    limit.
    """
    observed, expected, limit = np.broadcast_arrays(
        np.asarray(observed, dtype=float), expected, np.asarray(within, dtype=float)
    )
    difference = np.abs(observed - expected)
    worst = np.unravel_index(np.argmax(difference / limit), difference.shape)
    print(
        f"{what}: observed {observed[worst]:.10g}, expected {expected[worst]:.10g}, "
        f"difference {difference[worst]:.2e}, allowed {limit[worst]:.2e}"
    )
    assert (difference <= limit).all(), what


def orders(errors: list[float], ratio: float = 2.0) -> np.ndarray:
    """Observed orders between neighbours of a refinement by ``ratio``, shape (n - 1,)."""
    values = np.asarray(errors)
    return np.log(values[:-1] / values[1:]) / np.log(ratio)


def print_table(title: str, parameter: list[Any], errors: list[float]) -> np.ndarray:
    """Print a refinement table and return its observed orders (n - 1,)."""
    observed = orders(errors)
    print(title)
    for value, error, order in zip(parameter, errors, [np.nan, *observed], strict=True):
        print(f"  {value!s:>8}  error {error:.4e}  order {order:.3f}")
    return observed


def free_dofs(model: Model) -> np.ndarray:
    """Numbers of the unknowns that are not held."""
    return np.setdiff1d(np.arange(model.n_dofs), model.constrained)


def matrix_of(
    model: Model, mass: float = 0.0, stiffness: float = 0.0, damping: float = 0.0
) -> sparse.csc_matrix:
    """``mass`` M + ``stiffness`` K + ``damping`` C on all unknowns; held ones are empty."""
    return whole_matrix(model, mass, stiffness, damping)


def free_matrices(model: Model) -> tuple[sparse.csc_matrix, sparse.csc_matrix]:
    """M and K on the unknowns that are not held."""
    free = free_dofs(model)
    mass, stiffness = matrix_of(model, mass=1.0), matrix_of(model, stiffness=1.0)
    return mass[free][:, free].tocsc(), stiffness[free][:, free].tocsc()


def solve_free(matrix: sparse.csc_matrix, model: Model, right: np.ndarray) -> np.ndarray:
    """Solution of a system on the unknowns that are not held, zero at the held ones."""
    free = free_dofs(model)
    result = np.zeros(model.n_dofs)
    result[free] = sparse_linalg.spsolve(matrix[free][:, free].tocsc(), right[free])
    return result


@contextmanager
def line_alone(model: Model, numerics: Numerics) -> Iterator[LineIntegrator]:
    """The time stepper of a line alone, all droppers taut."""
    ownership = distribute(model, COMM.size, COMM.rank)
    line = make_line(COMM, model, ownership, numerics)
    try:
        yield line
    finally:
        line.destroy()


def release(
    line: LineIntegrator, displacement: np.ndarray, velocity: np.ndarray, model: Model
) -> None:
    """Start from a state with the acceleration that belongs to it: M a = -K d - C v."""
    force = matrix_of(model, stiffness=1.0) @ displacement
    force += matrix_of(model, damping=1.0) @ velocity
    acceleration = solve_free(matrix_of(model, mass=1.0), model, -force)
    line.start(displacement, velocity, acceleration)


def step(line: LineIntegrator) -> None:
    """One step of the line without loads."""
    line.free_step()


@dataclass
class History(Observer):
    """Records what the march shows: arrays with one row a step, the initial state included.

    Each state is shown to ``watch``; without it blocks of steps are shown at once.
    """

    watch: Callable[[StepView], Any] | None = None
    time: list[float] = field(default_factory=list)
    watched: list[Any] = field(default_factory=list)
    stage: Stage | None = None
    outcome: Outcome | None = None

    def __post_init__(self) -> None:
        self._rows: dict[str, list[np.ndarray]] = {
            name: []
            for name in (
                "contact_position",
                "contact_force",
                "head_height",
                "wire_height",
                "dropper_force",
                "arm_uplift",
            )
        }

    def start(self, stage: Stage) -> None:
        self.stage = stage

    def next_state(self, step: int) -> int:
        return NEVER if self.watch is None else step + 1

    def observe(self, view: StepView) -> None:
        self.time.extend(view.times.tolist())
        if self.watch is not None:
            self.watched.append(self.watch(view))
        for name, rows in self._rows.items():
            rows.extend(view.each(name).copy())

    def __getitem__(self, channel: str) -> np.ndarray:
        return np.array(self._rows[channel])


def energies_of_free_motion(
    model: Model, lifted: np.ndarray, struck: np.ndarray, n_steps: int, every: int
) -> tuple[np.ndarray, np.ndarray]:
    """Energy of an undamped line every so many steps of 1 ms, kinetic and in all (n,) [J].

    It is released from a displacement ``lifted`` [m] with velocities ``struck`` [m/s].
    """
    found = []
    with line_alone(model, replace(model.problem.numerics, dt=1e-3)) as stepper:
        release(stepper, lifted, struck, model)
        for number in range(n_steps + 1):
            if number % every == 0:
                found.append(stepper.energies())
            step(stepper)
    kinetic, elastic = np.array(found).T
    return kinetic, kinetic + elastic


def start_march(
    problem: Problem,
    mesh: LineMesh,
    change_form: Callable[[Equilibrium], Equilibrium] = lambda f: f,
) -> tuple[March, Model]:
    """A march on a line at rest, or on what ``change_form`` makes of its shape at rest."""
    rest = line_at_rest(problem, mesh)
    return March(COMM, *rest._replace(form=change_form(rest.form))), rest.model


def march(
    problem: Problem,
    mesh: LineMesh,
    watch: Callable[[StepView], Any] | None = None,
    change_form: Callable[[Equilibrium], Equilibrium] = lambda f: f,
    since: Mapping[str, Any] | None = None,
) -> History:
    """March to the end, from a state or the start, and return what was seen; what ``watch`` returns
    of each step is kept."""
    run, _ = start_march(problem, mesh, change_form)
    history = History(watch)
    try:
        if since is not None:
            run.restore({name: np.array(value) for name, value in since.items()})
        history.outcome = run.run([history])
    finally:
        run.destroy()
    assert history.outcome.outcome == "done", history.outcome.outcome
    return history


def continued(problem: Problem, mesh: LineMesh, at: int) -> tuple[History, History]:
    """A march, which keeps its state of step ``at``, and one that goes on from that state.

    Fails unless steps, times and number of states of the second are those of the first from there.
    """
    whole = march(problem, mesh, lambda view: view.checkpoint() if view.step == at else None)
    rest = march(problem, mesh, since=whole.watched[at])
    assert len(rest.time) == len(whole.time) - at > 1
    check("times [s]", rest.time, whole.time[at:], within=1e-15)
    return whole, rest


def check_continued(whole: History, rest: History, at: int, *channels: str) -> None:
    """Compare channels of marches of ``continued``: the same operations on the same numbers, each
    relative to its largest."""
    for channel in channels:
        expected = whole[channel][at:]
        check(channel, rest[channel], expected, within=1e-12 * np.abs(expected).max())


def order_of_march(
    problem: Problem, mesh: LineMesh, n_steps: int, since: float = 0.0
) -> tuple[float, float]:
    """Observed order in the step of the contact force, and the one expected of a method of order 2.

    Steps halve from 1 ms on, ``n_steps`` of them down to 1/8 ms; the force is
    compared every 4 ms from the time ``since`` [s] on with that of steps of 1/32 ms.
    """

    def force(dt: float) -> np.ndarray:
        own = replace(problem, numerics=replace(problem.numerics, dt=dt))
        found = march(own, mesh)["contact_force"][:, 0]
        return found[:: round(4e-3 / dt)][round(since / 4e-3) :]

    steps = [1e-3 / 2**k for k in range(4 - n_steps, 4)]
    reference = force(1e-3 / 32)
    errors = [float(np.sqrt(((force(dt) - reference) ** 2).mean())) for dt in steps]
    observed = print_table(
        "rms error of the contact force [N], expected order 2",
        [f"{1e3 * dt:g} ms" for dt in steps],
        errors,
    )
    # The reference has an error of its own, (1/4)^2 of that of the finest step, which all errors
    # lack.
    expected = orders([1 / 4**2 - 1 / 32**2, 1 / 8**2 - 1 / 32**2])[0]
    return float(observed[-1]), float(expected)


@contextmanager
def registered(effect: Effect) -> Iterator[None]:
    """An effect of the test's own, known to the registry while the block runs."""
    registry()  # the shipped ones come first
    register(effect)
    try:
        yield
    finally:
        unregister(effect.name)
