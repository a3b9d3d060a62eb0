"""The one place that knows all methods that advance the line."""

from __future__ import annotations

from typing import Any

import numpy as np

from catenary.solver.distribution import Ownership
from catenary.solver.generalized_alpha import GeneralizedAlphaLine
from catenary.solver.integration import NEWMARK, integration_of
from catenary.solver.line_motion import LineMotion
from catenary.solver.model import Model
from catenary.solver.newmark import NewmarkLine
from catenary.solver.problem import Numerics
from catenary.solver.unbalanced_line import UnbalancedAlphaLine, UnbalancedNewmarkLine


def make_line(
    comm: Any,
    model: Model,
    ownership: Ownership,
    numerics: Numerics,
    lost: np.ndarray | None = None,
) -> LineMotion:
    """The line with the method that the numerics ask for. Collective.

    ``lost`` (n_dofs,) is the balance that incidents have taken from it [N], [N m].
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
    return line
