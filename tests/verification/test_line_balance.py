"""Newmark's energy balance of the line, which hard cases are judged by, to round-off.

The dissipation of each step is formed from the states before and after it with matrices assembled
here; energy less work falls by that and by nothing else, with and without numerical damping.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from mpi4py import MPI
from scenes import load_scene
from scipy.sparse import csr_matrix

from catenary.cases.studies.hard import checks as hard_checks
from catenary.cases.studies.hard import runs as hard_runs
from catenary.cases.studies.hard.cases import HardCase, hard_cases
from catenary.solver.contact.contact_wire import ContactWires
from catenary.solver.model.matrices import whole_matrix
from catenary.solver.model.model import Model
from catenary.solver.model.partition import distribute
from catenary.solver.time_loop.march import March
from catenary.solver.time_loop.views.observers import StepView

COMMON = (
    "line.n_spans=4",
    "mesh.elements_per_gap=2",
    "train.start_m=80",
    "train.end_m=110",
    "train.raise_time_s=0.1",
    "evaluation.from_m=90",
    "evaluation.to_m=110",
    "effects.dropper_slackening=false",
    # A head that hops: contact is lost and regained every few steps.
    "pantographs.reference.masses_kg=[0.5,15.0]",
    "contact.stiffness_N_per_m=1e7",
)


class States(hard_runs.Watcher):
    """Keeps displacement, velocity and acceleration of each step besides."""

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self.states: list[tuple[np.ndarray, ...]] = []

    def observe(self, view: StepView) -> None:
        super().observe(view)
        state = view.line_state()
        names = ("displacement", "velocity", "acceleration")
        self.states.append(tuple(state[name].copy() for name in names))


def matrix(model: Model, *shares: float) -> csr_matrix:
    return whole_matrix(model, *shares).tocsr()


@pytest.mark.parametrize("damping", [0.0, 1e-3])
@pytest.mark.parametrize(("gamma", "beta"), [(0.5, 0.25), (0.5, 0.27), (0.6, 0.3025), (0.7, 0.4)])
def test_energy_falls_by_what_damping_takes_and_nothing_else(
    gamma: float, beta: float, damping: float
) -> None:
    words = (f"numerics.newmark_gamma={gamma}", f"numerics.newmark_beta={beta}")
    scene = load_scene("en50318_2002", [*COMMON, *words, f"line.damping.alpha_s={damping}"])
    rest = hard_runs.at_rest(scene, MPI.COMM_SELF)
    model, dt = rest.model, rest.problem.numerics.dt
    wire = ContactWires(model, rest.form, distribute(model, 1, 0))
    balance = hard_runs.LineBalance(model, rest.problem, rest.form.dropper_force)
    watcher = States(wire, (), balance)
    with March(MPI.COMM_SELF, rest.problem, model, rest.form, rest.lift) as march:
        assert march.run([watcher]).outcome == "done"
    run = watcher.histories("done", {})

    u, v, a = (np.array(part) for part in zip(*watcher.states, strict=True))
    mass, stiffness, viscous = (
        matrix(model, 1, 0, 0),
        matrix(model, 0, 1, 0),
        matrix(model, 0, 0, 1),
    )
    excess, d = gamma - 0.5, beta - gamma / 2

    def form(each: csr_matrix, of: np.ndarray) -> np.ndarray:
        return np.einsum("ij,ij->i", of, (each @ of.T).T)

    du, da = np.diff(u, axis=0), np.diff(a, axis=0)
    taken = excess * (form(stiffness, du) + dt**2 * d * form(mass, da))
    taken += dt * form(viscous, 0.5 * (v[1:] + v[:-1]) + 0.5 * dt * d * da)
    taken += dt**3 * d * (excess**2 - d / 4) * form(viscous, da)
    fell = -np.diff(run.energy + run.terms - run.work)
    assert np.abs(fell - taken).max() < 1e-10 * run.energy_scale()
    lost = run.force[:, 0] == 0.0
    assert (lost[1:] != lost[:-1]).any()  # contact switches


def energy_is_kept(case: HardCase) -> bool:
    ((found, remarks),) = hard_checks.check_cases([case], MPI.COMM_SELF, short=True)
    kept = {row.name: row.passed for row in found}
    assert kept["everything is finite"]
    # The watch of all runs judges more coarsely, and ends none of these marches.
    told = [text for own in remarks.values() for text in own if "makes energy" in text]
    assert not (told and kept["energy made by the integration"])
    assert told or "effects.stiff_link_damping=false" not in case.set
    return kept["energy made by the integration"]


@pytest.mark.study
def test_the_criterion_fails_where_energy_is_made(monkeypatch: pytest.MonkeyPatch) -> None:
    """Newmark's gamma below 1/2 feeds the line; so do undamped stiff droppers, and half a work."""
    case, stiff = hard_cases(["light_head_damped"])[0], hard_cases(["droppers_1e8"])[0]
    assert energy_is_kept(case)

    undamped = ["numerics.newmark_gamma=0.5", "numerics.newmark_beta=0.25", "numerics.dt_s=1e-3"]
    undamped += ["effects.stiff_link_damping=false"]
    assert not energy_is_kept(stiff.model_copy(update={"set": [*stiff.set, *undamped]}))

    sound = hard_runs.at_rest

    def fed(scene: Any, comm: Any) -> hard_runs.LineAtRest:
        rest = sound(scene, comm)
        numerics = replace(rest.problem.numerics, gamma=0.3, beta=0.25)
        return rest._replace(problem=replace(rest.problem, numerics=numerics))

    with monkeypatch.context() as wrong:
        wrong.setattr(hard_runs, "at_rest", fed)
        assert not energy_is_kept(case)

    def half(model: Model, problem: Any, tension: np.ndarray) -> hard_runs.LineBalance:
        made = hard_runs_balance(model, problem, tension)
        made.weights = 0.5 * made.weights[0], 0.5 * made.weights[1]
        return made

    hard_runs_balance = hard_runs.LineBalance
    monkeypatch.setattr(hard_runs, "LineBalance", half)
    assert not energy_is_kept(case)


def test_only_droppers_that_slacken_leave_a_load_across_them() -> None:
    """What one that breaks did across it is gone with it: no load on the line that is left."""
    broken = "incidents=[{type='dropper_break',at_s=0.05,span=3,dropper=5}]"
    found = []
    for words in ([], [broken]):
        common = ["line.n_spans=6", "mesh.elements_per_gap=1", "train.start_m=80"]
        ways = ["train.end_m=200", "evaluation.from_m=150", "evaluation.to_m=160"]
        rest = hard_runs.at_rest(
            load_scene("ac_simple_3d", [*common, *ways, *words]), MPI.COMM_SELF
        )
        balance = hard_runs.LineBalance(rest.model, rest.problem, rest.form.dropper_force)
        # All wires but the contact wire go aside, which takes no dropper's force.
        moved = np.zeros((2, rest.model.n_dofs))
        moved[1, rest.model.dofs(rest.mesh.droppers[:, 0], "v")] = 1e-3
        states = {"displacement": moved, "velocity": np.zeros_like(moved)}
        slack = np.zeros((2, len(rest.mesh.droppers)), dtype=bool)
        found.append(float(balance.across(states, slack)[1][0]))
    length = 1.0  # of droppers, roughly [m]
    force = float(rest.form.dropper_force.sum())
    assert 0.2 * force * 1e-6 / 2 / length < found[0] < 5 * force * 1e-6 / 2 / length
    assert found[1] == 0.0
