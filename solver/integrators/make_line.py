"""The one place that knows all methods that advance the line."""

from __future__ import annotations

import logging
from typing import Any

import numpy as np

from catenary.solver.integrators.detour import PARTS, Detour, method_detour
from catenary.solver.integrators.generalized_alpha import GeneralizedAlphaLine
from catenary.solver.integrators.line_integrator import LineIntegrator
from catenary.solver.integrators.newmark import NewmarkLine
from catenary.solver.model.model import Model
from catenary.solver.model.partition import Ownership
from catenary.solver.problem.integrator_parameters import NEWMARK, integration_of
from catenary.solver.problem.problem import Numerics

logger = logging.getLogger(__name__)


def make_line(
    comm: Any,
    model: Model,
    ownership: Ownership,
    numerics: Numerics,
    lost: np.ndarray | None = None,
    only_free: bool = True,
    loaded: bool = False,
) -> LineIntegrator:
    """The line with the method that the numerics ask for. Collective.

    Parameters
    ----------
    lost : (n_dofs,) the balance that incidents have taken from it [N], [N m]
    only_free : whether its steps will all be free ones, not taken in parts
    loaded : whether its steps will have loads
    """
    if numerics.integrator == NEWMARK:
        line: LineIntegrator = NewmarkLine(comm, model, ownership, numerics)
    else:
        chosen = integration_of(numerics.integrator, numerics.spectral_radius)
        line = GeneralizedAlphaLine(comm, model, ownership, numerics.dt, chosen)
    if lost is not None and lost.any():
        line.lose(lost)
    if only_free:
        line.keep_ahead(loaded)
    reason = method_detour(numerics, not model.damping_is_proportional)
    if reason and numerics.scheme == "one_solve":
        line.detour = Detour(reason, PARTS)
    if line.detour is not None and comm.rank == 0:
        logger.warning("%s", line.detour)
    return line
