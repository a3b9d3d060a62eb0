"""Rows that drive heads, and tables of these, as kernels take them (`solver/kernels/heads`)."""

from __future__ import annotations

import numpy as np

from catenary.solver.kernels import native

N_DRIVE = native.DRIVE.itemsize // 8


def drive_width(n_strips: int) -> int:
    """Numbers of a step's row for a head with so many strips."""
    return N_DRIVE + 2 * n_strips


def named(rows: np.ndarray) -> np.ndarray:
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
