"""The line at rest in the lateral plane: where wires are, and what arms pull."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

# Forces smaller than this give a bar no direction [N].
_NO_FORCE = 1e-6


@dataclass(frozen=True)
class LateralShape:
    """Where wires are laterally at rest, and what steady arms do there.

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

    @property
    def arm_inclination(self) -> np.ndarray:
        """By how much each arm rises from its wire to its hinge, (n_arms,) [rad]."""
        sideways, upward, along = self.arm_direction.T
        return np.arctan2(upward, np.hypot(sideways, along))

    @property
    def arm_slew(self) -> np.ndarray:
        """By how much the hinge of each arm is ahead of its wire along the track, seen from above,
        (n_arms,) [rad]."""
        sideways, _, along = self.arm_direction.T
        return np.arctan2(along, np.abs(sideways))
