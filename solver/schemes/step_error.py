"""Error of the contact forces by a step: an estimate from depths that are known anyway.

Average acceleration misses h^3 / 12 times the third derivative of a motion in a step of h. At a
contact the motion is the depth, whose latest values a march has. With the second
derivatives a, twice the divided differences, of this step and the one before, the depth is wrong by
h^2 / 12 (a_n - a_n-1) (Zienkiewicz and Xie 1991, for beta = 1/4), and the force by this times the
stiffness of the contact. What changes within a step (a landing, a kink of the force) is thereby
taken to happen in this step. Without contact at either end the depth moves no force.

Where contact is made within a step, at a share s of it, the force f at its end acts for the whole
step: the impulse is wrong by s h f / 2 < h f / 2, which sets head and wire swinging on the contact.
With k its stiffness, m the mass that swings and D = h^2 / 4 m what a force takes off the depth
within a step, the force is wrong by k h f / (2 m omega) = sqrt(k D) f. Likewise where it is lost.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from catenary.solver.kernels import native

# Steps before this one that the estimate needs.
_PAST = 3


class Past(NamedTuple):
    """The latest steps, oldest first.

    Attributes
    ----------
    times : (3,) their ends [s]
    depths : (3, n) of n contacts [m]
    forces : (n,) at the end of the last [N]
    """

    times: np.ndarray
    depths: np.ndarray
    forces: np.ndarray


class Tried(NamedTuple):
    """A step that is judged, (n,) each; see ``StepError.of``."""

    depth: np.ndarray
    force: np.ndarray
    stiffness: np.ndarray
    compliance: np.ndarray


class StepError:
    """The estimate for n contacts, with the depths that it remembers. On rank 0; not collective."""

    def __init__(self, n: int) -> None:
        self._past = Past(np.zeros(_PAST), np.zeros((_PAST, n)), np.zeros(n))
        self._known = 0
        self._tried = Tried(*np.zeros((4, n)))
        arguments = self._tried, self._past
        self._largest = native.step_error.bound(*arguments)
        self._remember = native.accept_step.bound(*arguments)

    def of(
        self,
        time: float,
        depth: np.ndarray,
        force: np.ndarray,
        stiffness: np.ndarray,
        compliance: np.ndarray,
    ) -> float | None:
        """Largest error of a contact force by a step to ``time`` [N]; None while it is unknown.

        Parameters
        ----------
        time : float
            End of the step [s].
        depth, force, stiffness : ndarray, shape (n,)
            Depths, forces and tangent stiffnesses of the contacts [m], [N], [N/m].
        compliance : ndarray, shape (n,)
            D, depth that a unit force takes off within the step [m/N].
        """
        if self._known < _PAST:
            return None
        given = depth, force, stiffness, compliance
        for array, values in zip(self._tried, given, strict=True):
            array[:] = values
        return float(self._largest(time))

    def accept(self, time: float, depth: np.ndarray, force: np.ndarray) -> None:
        """Remember a step that was taken."""
        self._tried.depth[:], self._tried.force[:] = depth, force
        self._remember(time)
        self._known = min(self._known + 1, _PAST)

    def state(self) -> np.ndarray:
        """Memory of the estimate, as one array of fixed length."""
        times, depths, forces = self._past
        return np.concatenate([[self._known], forces, times, depths.ravel()], dtype=float)

    def restore(self, state: np.ndarray) -> None:
        """Continue from what ``state`` returned."""
        times, depths, forces = self._past
        n = forces.size
        self._known = int(state[0])
        forces[:] = state[1 : 1 + n]
        times[:] = state[1 + n : 1 + n + _PAST]
        depths[:] = state[1 + n + _PAST :].reshape(depths.shape)
