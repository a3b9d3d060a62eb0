"""Target heights of the form finding: of the contact wire above its height at the supports."""

from __future__ import annotations

import numpy as np

from catenary.meshgen.line import Line


def pre_sag(line: Line, x: np.ndarray) -> np.ndarray:
    """Minus the pre-sag at positions ``x`` [m]: linear between droppers, zero at the masts."""
    masts = line.support_positions
    at, sag = [masts], [np.zeros(masts.size)]
    for start, droppers, values in zip(
        masts[:-1], line.dropper_positions, line.pre_sag, strict=True
    ):
        at.append(start + np.asarray(droppers))
        sag.append(np.asarray(values, dtype=float))
    position = np.concatenate(at)
    order = np.argsort(position)
    return -np.interp(x, position[order], np.concatenate(sag)[order])


def transition(line: Line, x: np.ndarray) -> np.ndarray:
    """Rise towards the tensioners in the transition spans, shape as ``x`` [m]."""
    return np.asarray(line.target_height(x) - line.contact_height)
