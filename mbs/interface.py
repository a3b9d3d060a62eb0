"""Interface of pantographs to the coupling, for lumped masses and multibody systems.

Heights are measured like the line's, z up [m]; contact forces are >= 0 in compression and push
the head down. A head touches the wire with s strips, mostly one; where several contact wires run
side by side each of them may touch each strip, and what is said of strips holds for contacts, those
of one strip together. A pantograph lives on rank 0 and is never called elsewhere.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from catenary.solver.kernels import native


def affine(numbers: np.ndarray, n: int) -> native.Affine:
    """Views of 2 n + 2 n^2 ``numbers``, in which the four stand one after the other."""
    squares = numbers[2 * n : 2 * n * (1 + n)].reshape(2, n, n)
    return native.Affine(numbers[:n], numbers[n : 2 * n], squares[0], squares[1])


class HeadState:
    """Strips at the end of the coming step as affine functions of the contact forces f (s,) [N].

    height = ``height`` - ``height_compliance`` f [m], velocity = ``velocity`` -
    ``velocity_compliance`` f [m/s]; shapes (s,) and (s, s). Velocities are those of the points
    that touch the wire, also where these move along a tilted strip.

    ``numbers`` (2 s + 2 s^2,) holds these four one after the other; they are its views, and
    ``affine`` has them under the names of the line's.
    """

    def __init__(self, n_strips: int) -> None:
        self.numbers = np.zeros(2 * n_strips * (1 + n_strips))
        self.affine = affine(self.numbers, n_strips)
        self.height, self.velocity, self.height_compliance, self.velocity_compliance = self.affine


class Pantograph(Protocol):
    """A pantograph that advances with the global contact step."""

    @property
    def strip_offsets(self) -> tuple[float, ...]:
        """Places of the strips ahead of the pantograph's own place along the track [m], (s,)."""

    def place(self, head_height: float, velocity: float = 0.0) -> None:
        """Put the pantograph without contact to where its head is at ``head_height`` [m], all of it
        moving upward with ``velocity`` [m/s]."""

    def extrapolate(self, time: float) -> tuple[np.ndarray, np.ndarray]:
        """Heights [m] and velocities [m/s] of the strips at ``time`` [s], the end of the coming
        step, from the present motion alone; (s,) each, overwritten by the next call."""

    def predict(self, time: float) -> HeadState:
        """Strips at ``time`` [s], the end of the coming step, as functions of the forces in it;
        overwritten by the next call."""

    def advance(self, contact_force: np.ndarray) -> None:
        """Take the step predicted last with the contact forces ``contact_force`` (s,) [N]."""

    def state(self) -> np.ndarray:
        """State to continue from, as one array."""

    def restore(self, state: np.ndarray) -> None:
        """Continue from what ``state`` returned."""

    def places(self) -> np.ndarray:
        """Coordinates of its masses or bodies, (k,); a view or a copy.

        Heights of lumped masses and of an arm, and angles of a head; of a mechanism that is moved
        body by body its positions and Euler parameters.
        """

    def base(self, time: float) -> float:
        """Height at ``time`` [s] of the base that a mechanism's points count from [m]; how far a
        vehicle has lifted it for lumped masses."""
