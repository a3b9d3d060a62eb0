"""Lateral motion on lines of all topologies: at rest, let go, and under a train for some steps."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from measuring import check, line_alone, matrix_of, release, solve_free, start_march, step
from scenes import load_scene, mesh_of, problem_of

from catenary.meshgen.mesh import LineMesh
from catenary.solver.model.model import Model
from catenary.solver.model.rest_shape import Equilibrium
from catenary.solver.problem.problem import Damping, Problem
from catenary.solver.statics.form_finding import find_form
from catenary.solver.time_loop.views.observers import Observer, StepView

EPS = np.finfo(float).eps
_TWIN = ["line.topology=twin_messenger", "line.twin={spacing_m=0.1,droppers='pairs'}"]
APART = "effects.relative_motion=true"
LINES: dict[str, tuple[str, list[str]]] = {
    "stitched": ("re330_stitched", []),
    "compound": ("shinkansen_compound", []),
    "twin": ("dc_twin", [APART]),
    "alternating": ("dc_twin", [APART, "line.twin={spacing_m=0.04,droppers='alternating'}"]),
    "twin_messenger": ("ac_simple", _TWIN),
    "single": ("tramway", []),
    "overlap": ("overlap", ["line.overlap.first_span=2", "line.overlap.n_spans=3"]),
}
N_SPANS = 6


@cache
def at_rest(name: str) -> tuple[Problem, LineMesh, Model, Equilibrium]:
    """A staggered line of six spans with a short run in its middle, two elements a gap."""
    case, more = LINES[name]
    own = load_scene(case)
    middle, kind = 0.5 * N_SPANS * own.line.span_m[0], own.train.pantographs[0].name
    words = [
        f"line.n_spans={N_SPANS}",
        "effects.lateral_motion=true",
        f"mesh.elements_per_gap={8 if name == 'single' else 2}",
        f"train.pantographs=[{{name='{kind}'}}]",
        f"train.start_m={middle - 4.0}",
        f"train.end_m={middle + 4.0}",
        "train.raise_time_s=0.01",
        f"evaluation.from_m={middle}",
        f"evaluation.to_m={middle + 4.0}",
        *more,
    ]
    scene = load_scene(case, words)
    problem, mesh = problem_of(scene), mesh_of(scene)
    return problem, mesh, *find_form(problem, mesh)


@pytest.mark.parametrize("name", LINES)
def test_wires_of_any_topology_rest_in_the_lateral_plane(name: str) -> None:
    """Droppers are taut, arms hold wires where the stagger says, and pull with what the kink of
    their wire takes, 4 T a / L on straight track."""
    problem, mesh, _, form = at_rest(name)
    lateral = form.lateral
    assert lateral is not None
    assert (form.dropper_force > 0.0).all() and (lateral.arm_tension > 50.0).all()
    for wire in problem.line.wires:
        own = mesh.wires[wire.name]
        supported = np.isin(own, np.concatenate([mesh.supports, mesh.steady_arms]))
        wanted = np.interp(mesh.x(own[supported]), wire.pieces[0].x, wire.pieces[0].y)
        if supported.any() and len(wire.pieces) == 1:
            check(wire.name, lateral.y[own[supported]], wanted, within=1e-9)
    # Leaning droppers and neighbours at an overlap pull as well: up to a third of the kink's.
    arm = mesh.steady_arms[len(mesh.steady_arms) // 2]
    name_of = next(w for w in mesh.wires if arm in mesh.wires[w])
    piece = next(p for p in problem.line.wire(name_of).pieces if p.x[0] < mesh.x(arm) < p.x[-1])
    at = int(np.argmin(np.abs(np.array(piece.x) - mesh.x(arm))))
    slope = np.diff(piece.y[at - 1 : at + 2]) / np.diff(piece.x[at - 1 : at + 2])
    kink = problem.line.wire(name_of).tension * (slope[0] - slope[1])
    pull = float(lateral.arm_force[list(mesh.steady_arms).index(arm), 0])
    check("pull of an arm over the kink", pull / kink, 1.15, within=0.2)


class Forces(Observer):
    """Keeps forces and lateral positions."""

    def __init__(self) -> None:
        self.rows: list[np.ndarray] = []

    def next_state(self, step: int) -> int:
        return step + 1

    def observe(self, view: StepView) -> None:
        self.rows.append(np.append(view.contact_force, np.nan_to_num(view.lateral_place)))

    def finish(self, outcome: str) -> None:
        assert outcome == "done"


@pytest.mark.study
@pytest.mark.parametrize("name", LINES)
def test_a_line_of_any_topology_keeps_its_energy_sideways_and_carries_a_train(name: str) -> None:
    problem, mesh, model, form = at_rest(name)
    load = np.zeros(model.n_dofs)
    load[model.dofs(model.contact_nodes[[model.contact_nodes.size // 3]])] = 200.0
    load[model.dofs(model.contact_nodes[[model.contact_nodes.size // 2]], "v")] = 50.0
    lifted = solve_free(matrix_of(model, stiffness=1.0), model, load)
    totals, n_steps = [], 300
    still = replace(model, simulated=replace(model.simulated, damping=Damping(0.0, 0.0)))
    with line_alone(still, problem.numerics) as stepper:
        release(stepper, lifted, np.zeros_like(lifted), still)
        for number in range(n_steps + 1):
            if number % 50 == 0:
                totals.append(sum(stepper.energies()))
            step(stepper)
    drift = np.abs(np.array(totals) / totals[0] - 1.0).max()
    check("relative change of the energy", drift, 0.0, within=1e3 * n_steps * EPS)
    run, _ = start_march(problem, mesh)
    seen = Forces()
    run.run([seen])
    run.destroy()
    rows = np.array(seen.rows)
    assert np.isfinite(rows).all() and 50.0 < rows[-1, 0] < 400.0
    assert np.abs(rows[:, 1:]).max() > 1e-3
