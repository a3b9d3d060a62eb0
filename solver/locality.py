"""How far the response to a point load reaches within one time step.

The step operator A = M + gamma dt C + beta dt^2 K is nearly a mass matrix: the columns of its
inverse decay exponentially along the track and vanish to round-off within about a span. The
parallel solver and the compliance table are both built on this length.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.sparse import linalg as sparse_linalg

from catenary.solver.model import Model, iterate_entries

# Beyond the reach a column is below this share of its peak; two orders under what an iteration
# over a whole run may add up to and still agree to 1e-9.
DECAY = 1e-16
# The probe looks at one place of the line; spans differ, so take this much more.
_MARGIN = 1.25
_WINDOW = 400.0


def reach(model: Model, coefficients: tuple[float, float, float]) -> float:
    """Distance along the track beyond which a column of A^-1 vanishes [m]. Not collective.

    ``coefficients`` are those of M, K and C in A. Solves with A on a window of the line for a
    load in the middle; returns the length of the line if the column does not decay within it.
    """
    positions = np.empty(model.mesh.n_nodes)
    positions[model.row_of_node] = model.mesh.points[:, 0]
    middle = 0.5 * (positions[0] + positions[-1])
    low, high = np.searchsorted(positions, [middle - _WINDOW, middle + _WINDOW])
    first, last = int(low) * model.block_size, int(high) * model.block_size
    parts = list(iterate_entries(model, first, last, *coefficients))
    rows, columns, values = (np.concatenate(part) for part in zip(*parts, strict=True))
    inside = (columns >= first) & (columns < last)
    matrix = sparse.csc_matrix(
        (values[inside], (rows[inside] - first, columns[inside] - first)),
        shape=(last - first, last - first),
    )
    empty = matrix.diagonal() == 0
    factor = sparse_linalg.splu((matrix + sparse.diags(empty.astype(float))).tocsc())
    x = np.repeat(positions[low:high], model.block_size)
    nearest = np.abs(x - middle).min()
    furthest = 0.0
    for load in np.flatnonzero((np.abs(x - middle) <= nearest + 1e-6) & ~empty):
        unit = np.zeros(last - first)
        unit[load] = 1.0
        column = np.abs(factor.solve(unit))
        big = column > DECAY * column.max()
        furthest = max(furthest, float(np.abs(x[big] - x[load]).max()))
    total = float(positions[-1] - positions[0])
    seen = min(_WINDOW, 0.5 * total)
    return total if furthest > 0.9 * seen else min(total, _MARGIN * furthest)
