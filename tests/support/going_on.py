"""Short lines that go on beyond their ends, beside the long lines that they stand for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from measuring import COMM
from small_lines import HANGING, en50318_line, mesh_of, problem_of, train

from catenary.solver.effects.build_model import build
from catenary.solver.integrators.line_integrator import LineIntegrator, make_line
from catenary.solver.model.loads import ShapeLoad, table
from catenary.solver.model.model import Model
from catenary.solver.model.partition import distribute
from catenary.solver.problem.ends import EndCondition, Fixed
from catenary.solver.problem.problem import Damping, Numerics

ENDS = {"structural_damping", "periodic_ends", "absorbing_layers"}
EN = Damping(1e-4, 0.0125)
SPAN = 60.0


def struck_line(
    n_spans: int,
    numerics: Numerics,
    n_steps: int,
    ends: tuple[EndCondition, EndCondition] = (Fixed(), Fixed()),
    damping: Damping = EN,
    before: int = 0,
) -> Model:
    """A line of EN 50318 that a blow strikes in the first span after ``before`` others."""
    line = en50318_line(n_spans)
    mesh, duration = mesh_of(line, 2), n_steps * numerics.dt
    problem = problem_of(
        line, HANGING | ENDS, damping=damping, numerics=numerics, ends=ends,
        train=train(1.0, 0.0, duration * (1.0 + 1e-6)),
    )  # fmt: skip
    model = build(problem, mesh, np.full(mesh.droppers.shape[0], 1.0))
    nodes = model.contact_nodes
    struck = nodes[[np.argmin(np.abs(mesh.x(nodes) - (SPAN * before + 23.5)))]]
    blow = table([0.0, 0.01, 0.03, 0.06], [0.0, 1.0, -0.5, 0.0])
    model.loads.append(ShapeLoad(model.dofs(struck), np.array([100.0]), blow))
    return model


def line_of(model: Model, ahead: bool = True) -> LineIntegrator:
    """What steps a line; ``ahead`` in two passes, otherwise in parts. Collective."""
    ownership = distribute(model, COMM.size, COMM.rank)
    return make_line(COMM, model, ownership, model.problem.numerics, only_free=ahead)


def heights(
    model: Model, n_steps: int, first: float, last: float, ahead: bool = True, name: str = "w"
) -> np.ndarray:
    """Uplift of the contact wire from ``first`` to ``last`` [m] after each step, (n_steps, n), or
    another unknown of that ``name``."""
    line, dt = line_of(model, ahead), model.problem.numerics.dt
    x = model.contact_x
    nodes = model.contact_nodes[(x >= first - 1e-6) & (x <= last + 1e-6)]
    unknowns, rows = model.dofs(nodes, name), []
    try:
        for step in range(1, n_steps + 1):
            line.load_at(step * dt)
            line.free_step()
            whole = np.concatenate(COMM.allgather(line.displacement))
            rows.append(whole[unknowns])
    finally:
        line.destroy()
    return np.array(rows)


def with_more(numerics: Numerics, **changes: float) -> Numerics:
    """Numerics with other numbers."""
    return replace(numerics, **changes)  # type: ignore[arg-type]
