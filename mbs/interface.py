"""Interface of pantographs to the coupling and the kernels: lumped masses, multibody systems.

Heights are measured like the line's, z up [m]; contact forces are >= 0 in compression and push
the head down. A head touches the wire with s strips, mostly one; where several contact wires run
side by side each of them may touch each strip, and what is said of strips holds for contacts, those
of one strip together. A pantograph lives on rank 0 and is never called elsewhere.

Kernels take rows that drive heads, and tables of these (`solver/kernels/heads`). A pantograph that
no kernel takes has its steps asked of Python by the loop of kernels.
"""

from __future__ import annotations

from collections.abc import Callable
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


N_DRIVE = native.DRIVE.itemsize // 8


def drive_width(n_strips: int) -> int:
    """Numbers of a step's row for a head with so many strips."""
    return N_DRIVE + 2 * n_strips


def drives_by_name(rows: np.ndarray) -> np.ndarray:
    """The numbers that have names of ``rows`` (..., width), a view of shape (...)."""
    return rows[..., :N_DRIVE].view(native.DRIVE)[..., 0]


def spline_tables(breaks: np.ndarray, coefficients: np.ndarray) -> native.SplineTables:
    """Tables of m cubic splines by scipy's ``coefficients`` (4, n - 1, m) over ``breaks`` (n,)."""
    return native.SplineTables(breaks, np.ascontiguousarray(coefficients.transpose(1, 2, 0)))


def tables_at(tables: native.SplineTables, x: float) -> tuple[np.ndarray, np.ndarray]:
    """Values and slopes (m,) of all splines; their ends go on beyond the breaks."""
    values, slopes = np.empty((2, tables.coefficients.shape[1]))
    native.tables_at(tables, x, values, slopes)
    return values, slopes


def called_by_kernels(
    model: Pantograph, after: Callable[[], None] = lambda: None
) -> tuple[native.Head, HeadState, np.ndarray]:
    """Any pantograph in a loop of kernels, which calls ``after`` after each step: its head, the
    latest prediction, and ``Pantograph.places`` at the end of the latest step, in one array."""
    head, places = HeadState(len(model.strip_offsets)), np.array(model.places())

    def predict(time: float) -> None:
        head.numbers[:] = model.predict(time).numbers

    def advance(contact_force: np.ndarray) -> None:
        model.advance(contact_force)
        places[:] = model.places()
        after()

    still = native.NewmarkFactors(0.0, 0.0, 0.0, 0.0, 0.0)
    strips = np.zeros((2, len(model.strip_offsets), 0))
    arrays = native.HeadArrays(strips, np.zeros(0), head.numbers, still, -1)
    return native.CalledHead(arrays, predict, advance), head, places
