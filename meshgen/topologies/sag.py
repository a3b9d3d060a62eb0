"""First guess of the course of a wire that hangs from supports at the masts."""

from __future__ import annotations

import numpy as np

from catenary.meshgen.spans import Spans
from catenary.meshgen.wires import Piece

# Only for the first guess of a sag; equilibrium uses the scene's value [m/s2].
GRAVITY = 9.81


def sagging(spans: Spans, x: np.ndarray, top: float, mass: float, tension: float) -> Piece:
    """A wire from anchor to anchor above the track, a parabola in each span.

    Parameters
    ----------
    x : places between the masts at which the course is to have points, ascending [m]
    top : height at the masts [m]
    mass : that it carries per length, its own included [kg/m]
    tension : of the wire [N]
    """
    masts = spans.support_positions
    x = np.unique(np.concatenate([masts, x]))
    span = np.clip(np.searchsorted(masts, x, side="right") - 1, 0, spans.n_spans - 1)
    along, length = x - masts[span], np.asarray(spans.span_lengths)[span]
    sag = np.where(np.isin(x, masts), 0.0, mass * GRAVITY * along * (length - along))
    z = top - sag / (2.0 * tension)
    return Piece(tuple(x.tolist()), (0.0,) * x.size, tuple(z.tolist()))
