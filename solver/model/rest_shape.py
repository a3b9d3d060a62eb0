"""The line at rest as arrays: what form finding finds and matrices are made about."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from catenary.solver.model.unknowns import LEVEL, UPRIGHT

# Forces smaller than this give a bar no direction [N].
_NO_FORCE = 1e-6


@dataclass(frozen=True)
class LateralShape:
    """Lateral shape of the wires at rest, and forces of steady arms there.

    Attributes
    ----------
    y, slope : (n_nodes,) lateral position [m] and dy/dx [-] of every mesh node
    arm_force : (n_arms, 3) of each steady arm on its wire: lateral, upward and along the track [N];
        an arm without length has one as well
    arm_pushed : (n_arms,) bool, arms that their wire pushes, as wind may do; empty if none is
    """

    y: np.ndarray
    slope: np.ndarray
    arm_force: np.ndarray
    arm_pushed: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=bool))

    @property
    def arm_tension(self) -> np.ndarray:
        """Tension of each steady arm as a bar between hinge and clamp, (n_arms,) [N]; negative of
        those that are pushed."""
        tension = np.asarray(np.linalg.norm(self.arm_force, axis=1))
        return np.where(self.arm_pushed, -tension, tension) if self.arm_pushed.any() else tension

    @property
    def arm_direction(self) -> np.ndarray:
        """Unit vectors from clamps to hinges, (n_arms, 3): lateral, upward and along [-].

        A bar pulls or pushes along itself only; without a force it lies level.
        """
        tension = self.arm_tension
        level = np.broadcast_to(np.array([1.0, 0.0, 0.0]), self.arm_force.shape)
        pulled = np.abs(tension) > _NO_FORCE
        return np.where(
            pulled[:, None], self.arm_force / np.where(pulled, tension, 1.0)[:, None], level
        )


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
    arm_raised : (n_arms,) how far the wire at each arm has risen since its installation, of lines
        with uplift stops, which do not rise [m]; empty where that is nothing
    lateral : the line at rest in the lateral plane, None if it is not simulated
    """

    height: np.ndarray
    slope: np.ndarray
    dropper_force: np.ndarray
    dropper_length: np.ndarray
    along: np.ndarray = field(default_factory=lambda: np.zeros(0))
    gained_tension: Mapping[str, np.ndarray] = field(default_factory=dict)
    arm_lift: np.ndarray = field(default_factory=lambda: np.zeros(0))
    arm_raised: np.ndarray = field(default_factory=lambda: np.zeros(0))
    lateral: LateralShape | None = None

    def leaning(self, droppers: np.ndarray) -> np.ndarray:
        """Displacement of the upper ends of ``droppers`` (n, 2) along the track, ahead of that of
        the lower ones, (n,) [m]."""
        upper, lower = self.moved_along(droppers).T
        return np.asarray(upper - lower)

    def moved_along(self, nodes: int | np.ndarray) -> np.ndarray:
        """How far nodes have moved along the track since the installation, shape as ``nodes``
        [m]."""
        return np.asarray(self.along[nodes] if self.along.size else np.zeros(np.shape(nodes)))

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
        yield UPRIGHT, self.height, self.slope
        if self.lateral is not None:
            yield LEVEL, self.lateral.y, self.lateral.slope
