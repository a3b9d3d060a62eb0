"""The line at rest as arrays: what form finding finds and matrices are made about."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np


@dataclass(frozen=True)
class Equilibrium:
    """The line at rest.

    Attributes
    ----------
    height : (n_nodes,) of every mesh node [m]
    slope : (n_nodes,) dw/dx of the wires at every mesh node [-]
    dropper_force : (n_droppers,) tension [N]
    dropper_length : (n_droppers,) unstretched length, by which the dropper is cut [m]
    along : (n_nodes,) how far every node has moved along the track since the installation [m];
        empty where that is nothing
    gained_tension : (n_elements,) of wires by name, what their elements carry beside the tension of
        the installation [N]; wires that are not named carry nothing more
    """

    height: np.ndarray
    slope: np.ndarray
    dropper_force: np.ndarray
    dropper_length: np.ndarray
    along: np.ndarray = field(default_factory=lambda: np.zeros(0))
    gained_tension: Mapping[str, np.ndarray] = field(default_factory=dict)

    def leaning(self, droppers: np.ndarray) -> np.ndarray:
        """How far the upper ends of ``droppers`` (n, 2) have moved ahead of the lower ones,
        (n,) [m]."""
        if self.along.size == 0:
            return np.zeros(len(droppers))
        return np.asarray(self.along[droppers[:, 0]] - self.along[droppers[:, 1]])
