"""The line at rest as arrays: what form finding finds and matrices are made about."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from catenary.solver.model.rest.lateral_shape import LateralShape


@dataclass(frozen=True)
class Equilibrium:
    """The line at rest.

    Attributes
    ----------
    height : (n_nodes,) of every mesh node [m]
    slope : (n_nodes,) dw/dx of the wires at every mesh node [-]
    dropper_force : (n_droppers,) tension [N]
    dropper_length : (n_droppers,) unstretched length by which the line is balanced on its mesh [m]
    along : (n_nodes,) how far every node has moved along the track since the installation [m];
        empty where that is nothing
    gained_tension : (n_elements,) of wires by name, what their elements carry beside the tension of
        the installation [N]; wires that are not named carry nothing more
    arm_lift : (n_arms,) force by which arms hold their wire at its height, zero of others [N]
    lateral : the line at rest in the lateral plane, None if it is not simulated
    """

    height: np.ndarray
    slope: np.ndarray
    dropper_force: np.ndarray
    dropper_length: np.ndarray
    along: np.ndarray = field(default_factory=lambda: np.zeros(0))
    gained_tension: Mapping[str, np.ndarray] = field(default_factory=dict)
    arm_lift: np.ndarray = field(default_factory=lambda: np.zeros(0))
    lateral: LateralShape | None = None

    def leaning(self, droppers: np.ndarray) -> np.ndarray:
        """How far the upper ends of ``droppers`` (n, 2) have moved ahead of the lower ones,
        (n,) [m]."""
        if self.along.size == 0:
            return np.zeros(len(droppers))
        return np.asarray(self.along[droppers[:, 0]] - self.along[droppers[:, 1]])

    def dropper_vectors(self, droppers: np.ndarray) -> np.ndarray:
        """From lower to upper ends of ``droppers`` (n, 2): along the track, to the left and
        upwards, (n, 3) [m]."""
        upper, lower = droppers.T
        sideways = np.zeros(len(droppers))
        if self.lateral is not None:
            sideways = self.lateral.y[upper] - self.lateral.y[lower]
        return np.stack(
            [self.leaning(droppers), sideways, self.height[upper] - self.height[lower]], axis=1
        )

    def planes(self) -> Iterator[tuple[tuple[str, str], np.ndarray, np.ndarray]]:
        """Unknowns of each plane that is simulated, course [m] and slope [-] of all nodes in it."""
        yield ("w", "theta_y"), self.height, self.slope
        if self.lateral is not None:
            yield ("v", "theta_z"), self.lateral.y, self.lateral.slope
