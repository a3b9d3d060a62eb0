"""The one place that knows all methods that advance the line."""

from __future__ import annotations

from typing import Any

import numpy as np

from catenary.solver.integrators.generalized_alpha import GeneralizedAlphaLine
from catenary.solver.integrators.line_integrator import LineMotion
from catenary.solver.integrators.lost_balance import UnbalancedAlphaLine, UnbalancedNewmarkLine
from catenary.solver.integrators.newmark import NewmarkLine
from catenary.solver.model.model import Model
from catenary.solver.model.partition import Ownership
from catenary.solver.problem.integrator_parameters import NEWMARK, integration_of
from catenary.solver.problem.problem import Numerics


def make_line(
    comm: Any,
    model: Model,
    ownership: Ownership,
    numerics: Numerics,
    lost: np.ndarray | None = None,
    only_free: bool = True,
) -> LineMotion:
    """The line with the method that the numerics ask for. Collective.

    Parameters
    ----------
    lost : (n_dofs,) the balance that incidents have taken from it [N], [N m]
    only_free : whether its steps will all be free ones without loads, and not taken in parts
    """
    unbalanced = lost is not None and bool(lost.any())
    if numerics.integrator == NEWMARK:
        kind = UnbalancedNewmarkLine if unbalanced else NewmarkLine
        line: LineMotion = kind(comm, model, ownership, numerics)
    else:
        chosen = integration_of(numerics.integrator, numerics.spectral_radius)
        way = UnbalancedAlphaLine if unbalanced else GeneralizedAlphaLine
        line = way(comm, model, ownership, numerics.dt, chosen)
    if isinstance(line, UnbalancedNewmarkLine | UnbalancedAlphaLine):
        assert lost is not None
        line.lose(lost)
    elif only_free and isinstance(line, NewmarkLine):
        line.keep_ahead()
    return line
