"""Target heights of the form finding: of wires that droppers hang, above the supports' level."""

from __future__ import annotations

import numpy as np

from catenary.meshgen.wires import Profile


def pre_sag(wanted: Profile, x: np.ndarray) -> np.ndarray:
    """Minus the pre-sag at positions ``x``, shape as ``x`` [m]."""
    return -wanted.pre_sag(x)


def transition(wanted: Profile, x: np.ndarray) -> np.ndarray:
    """Rise towards the tensioners in the transition spans, shape as ``x`` [m]."""
    return np.asarray(wanted.level(x) - wanted.base(x))
