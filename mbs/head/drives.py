"""What a head's steps depend on besides its state, known before: a row of numbers for each step.

A row begins with what ``native.DRIVE`` names (`solver/kernels/heads/drive.hpp`); behind that stand
the lateral places of the wire on the head's strips [m] and their rates [m/s].
"""

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
