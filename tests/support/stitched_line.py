"""A line with a third wire over some metres at each support, which comes and goes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from small_lines import WHOLE, en50318_line, make_line, mesh_of, problem_of

from catenary.meshgen.line import Line
from catenary.meshgen.wires import Conductor, Piece, Role, Wire
from catenary.solver.model.model import Model
from catenary.solver.problem.problem import Damping, Problem
from catenary.solver.statics.form_finding import find_form

STITCH = "stitch_wire"


def stitched_line(n_spans: int, length: float = 18.0) -> Line:
    """The line of EN 50318 with held pieces of a third wire, ``length`` [m] each."""
    line = make_line(en50318_line(n_spans))
    masts = line.support_positions[1:-1]
    pieces = tuple(
        Piece((mast - length / 2, mast + length / 2), (0.0, 0.0), (6.5, 6.5)) for mast in masts
    )
    wire = Wire.of(Conductor(3.5e3, 0.31, 25.0), STITCH, Role.STITCH, pieces)
    return replace(line, wires=(*line.wires, wire))


def stitched_problem(n_spans: int, damping: Damping, **changes: object) -> Problem:
    """A problem on such a line."""
    return problem_of(stitched_line(n_spans), WHOLE, damping=damping, **changes)


def stitched_model(n_spans: int, damping: Damping) -> Model:
    """The model of such a line."""
    problem = stitched_problem(n_spans, damping)
    return find_form(problem, mesh_of(problem.line, 3))[0]


def motion(model: Model, seed: int) -> list[np.ndarray]:
    """Displacement, velocity and acceleration of all unknowns that are not held."""
    rng, free = np.random.default_rng(seed), np.ones(model.n_dofs)
    free[model.constrained] = 0.0
    return [rng.standard_normal(model.n_dofs) * free * scale for scale in (1e-3, 0.1, 10.0)]
