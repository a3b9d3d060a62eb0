"""What a checkpoint has to hold for a line that goes on from it."""

from __future__ import annotations

from typing import Any

import numpy as np

from catenary.solver.base.errors import InputError


def like(checkpoint: dict[str, Any], name: str, wanted: np.ndarray) -> np.ndarray:
    """The finite array of a checkpoint that is to have the shape of ``wanted``."""
    if name not in checkpoint:
        raise impossible(f"{name} is missing")
    values, shape = np.asarray(checkpoint[name]), np.shape(wanted)
    if values.dtype.kind not in "fiub" or values.shape != shape:
        raise impossible(f"{name} has the shape {values.shape} in place of {shape}")
    if not np.isfinite(values).all():
        raise impossible(f"{name} holds NaN or infinity")
    return values


def impossible(what: str) -> InputError:
    """The error of a state that is of another scene."""
    return InputError(
        f"the state to continue from does not belong to this scene: {what}; start the run anew"
    )
