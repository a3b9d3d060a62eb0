"""The one place that knows all methods that advance the line."""

from __future__ import annotations

from typing import Any

from catenary.solver.integrators.detour import (
    CALLED,
    PARTS,
    Detour,
    load_detour,
    log_detour,
    method_detour,
)
from catenary.solver.integrators.line_integrator import LineIntegrator
from catenary.solver.integrators.newmark import NewmarkLine
from catenary.solver.linear.pieces.operator_pieces import WantedPieces
from catenary.solver.model.model import Model
from catenary.solver.model.partition import Ownership
from catenary.solver.problem.integrator_parameters import NEWMARK, integration_of
from catenary.solver.problem.problem import Numerics


def make_line(
    comm: Any,
    model: Model,
    ownership: Ownership,
    numerics: Numerics,
    only_free: bool = True,
    wanted: WantedPieces | None = None,
) -> LineIntegrator:
    """The line with the method that the numerics ask for. Collective.

    Parameters
    ----------
    only_free : whether its steps will all be free ones, not taken in parts
    wanted : which part of the line they need at a time, None if all of it
    """
    if numerics.integrator == NEWMARK:
        line: LineIntegrator = NewmarkLine(comm, model, ownership, numerics, wanted)
    else:
        from catenary.solver.integrators.generalized_alpha import GeneralizedAlphaLine

        chosen = integration_of(numerics.integrator, numerics.spectral_radius)
        line = GeneralizedAlphaLine(comm, model, ownership, numerics.dt, chosen, wanted)
    if only_free:
        line.keep_ahead()
    reason = method_detour(numerics)
    if reason and numerics.scheme == "one_solve":
        line.detour = Detour(reason, PARTS)
    reason = load_detour(model)
    if reason and line.detour is None:
        line.detour = Detour(reason, CALLED)
    if line.detour is not None and comm.rank == 0:
        log_detour(line.detour)
    return line
