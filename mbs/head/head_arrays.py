"""Records of heads, and rows that drive them, as kernels take them (`solver/kernels/heads`)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from catenary.solver.kernels import native


class NewmarkFactors(NamedTuple):
    """Factors of Newmark's formulas, the same for all coordinates."""

    dt: float
    predict_position: float
    predict_velocity: float
    position: float
    velocity: float


class HeadArrays(NamedTuple):
    """Arrays of any head with n coordinates and s strips."""

    touch: np.ndarray
    state: np.ndarray
    out: np.ndarray
    newmark: NewmarkFactors
    roll: int


class LinearStep(NamedTuple):
    """A step of a linear chain without contact."""

    matrix: np.ndarray
    by_drive: np.ndarray
    by_head: np.ndarray
    inverse: np.ndarray


class SprungMasses(NamedTuple):
    """Masses on linear springs and dampers."""

    masses: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray
    push: np.ndarray


class SplineTables(NamedTuple):
    """m cubic splines over the same ``breaks`` (n,): ``coefficients`` (n - 1, m, 4) from each break
    to the next, the highest power first. Their ends go on beyond the breaks."""

    breaks: np.ndarray
    coefficients: np.ndarray

    def at(self, x: float) -> tuple[np.ndarray, np.ndarray]:
        """Values and slopes (m,) of all."""
        values, slopes = np.empty((2, self.coefficients.shape[1]))
        native.tables_at(self, x, values, slopes)
        return values, slopes


class MechanismArrays(NamedTuple):
    """A reduced mechanism below a head."""

    tables: SplineTables
    weight: float
    zero: float


N_DRIVE = native.DRIVE.itemsize // 8


def drive_width(n_strips: int) -> int:
    """Numbers of a step's row for a head with so many strips."""
    return N_DRIVE + 2 * n_strips


def named(rows: np.ndarray) -> np.ndarray:
    """The numbers that have names of ``rows`` (..., width), a view of shape (...)."""
    return rows[..., :N_DRIVE].view(native.DRIVE)[..., 0]
