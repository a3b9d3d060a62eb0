"""Arrays between pantographs, the coupling and kernels: strips, rows that drive heads, tables.

See `solver/kernels/heads` for what kernels make of them.
"""

from __future__ import annotations

import numpy as np

from catenary.solver.kernels import native


def affine(numbers: np.ndarray, n: int) -> native.Affine:
    """Views of 2 n + 2 n^2 ``numbers``, in which the four stand one after the other."""
    squares = numbers[2 * n : 2 * n * (1 + n)].reshape(2, n, n)
    return native.Affine(numbers[:n], numbers[n : 2 * n], squares[0], squares[1])


class HeadState:
    """Strips at the end of the coming step as affine functions of the contact forces f (s,) [N].

    height = ``height`` - ``height_compliance`` f [m], velocity = ``velocity`` -
    ``velocity_compliance`` f [m/s]; shapes (s,) and (s, s). Velocities are those of the points
    that touch the wire, also where these move along a tilted strip.

    ``numbers`` (2 s + 2 s^2,) holds these four one after the other; they are its views, and
    ``affine`` has them under the names of the line's.
    """

    def __init__(self, n_strips: int) -> None:
        self.numbers = np.zeros(2 * n_strips * (1 + n_strips))
        self.affine = affine(self.numbers, n_strips)
        self.height, self.velocity, self.height_compliance, self.velocity_compliance = self.affine


N_DRIVE = native.DRIVE.itemsize // 8


def drive_width(n_strips: int) -> int:
    """Numbers of a step's row for a head with so many strips."""
    return N_DRIVE + 2 * n_strips


def drives_by_name(rows: np.ndarray) -> np.ndarray:
    """The numbers that have names of ``rows`` (..., width), a view of shape (...)."""
    return rows[..., :N_DRIVE].view(native.DRIVE)[..., 0]


def spline_tables(breaks: np.ndarray, coefficients: np.ndarray) -> native.SplineTables:
    """Tables of m cubic splines by scipy's ``coefficients`` (4, n - 1, m) over ``breaks`` (n,)."""
    return native.SplineTables(breaks, np.ascontiguousarray(coefficients.transpose(1, 2, 0)))


def tables_at(tables: native.SplineTables, x: float) -> tuple[np.ndarray, np.ndarray]:
    """Values and slopes (m,) of all splines; their ends go on beyond the breaks."""
    values, slopes = np.empty((2, tables.coefficients.shape[1]))
    native.tables_at(tables, x, values, slopes)
    return values, slopes
