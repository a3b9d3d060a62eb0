"""The one place that knows all methods that advance the line."""

from __future__ import annotations

from typing import Any

from catenary.solver.distribution import Ownership
from catenary.solver.generalized_alpha import GeneralizedAlphaLine
from catenary.solver.integration import NEWMARK, integration_of
from catenary.solver.line_motion import LineMotion
from catenary.solver.model import Model
from catenary.solver.newmark import NewmarkLine
from catenary.solver.problem import Numerics


def make_line(comm: Any, model: Model, ownership: Ownership, numerics: Numerics) -> LineMotion:
    """The line with the method that the numerics ask for. Collective."""
    if numerics.integrator == NEWMARK:
        return NewmarkLine(comm, model, ownership, numerics)
    chosen = integration_of(numerics.integrator, numerics.spectral_radius)
    return GeneralizedAlphaLine(comm, model, ownership, numerics.dt, chosen)
