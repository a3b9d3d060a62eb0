"""The end of a periodic line in steps of Newmark's family: stiffness and memory.

A step's formulas make displacement and velocity where a line ends sums over the accelerations b
that balanced the forces there, d^ = p_u b^ and v^ = p_v b^ in terms of generating functions
x^(zeta) = sum of x_n zeta^n. The half line beyond, which is stepped alike, then answers with the
force

    f^ = -G(zeta) b^,       G: half line of M + p_v C + p_u K        (eliminated exactly)

Of G the static stiffness K0, C0 = alpha K0 + beta M0 and a mass M0 go into the line's matrices,
M0 being what makes the step's own part right, G(0) = M0 + tau C0 + sigma K0. The rest is a sum over
the past, with numbers Q_j that are found on a circle within the unit circle (C. Lubich, Numer.
Math. 52, 1988): nothing is reflected but round-off.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import fft

from catenary.solver.ends.half_lines import chain_at, half_lines
from catenary.solver.ends.line_beyond import END, LineBeyond
from catenary.solver.problem.integrator_parameters import Integration

# Radius^(2 n) of the circle for n numbers: what aliases, and the square of what round-off grows by.
_ALIASED = 1e-12
# Frequencies at a time.
_AT_ONCE = 1024


@dataclass(frozen=True)
class StepSums:
    """Recursion of velocity and displacement in steps of ``dt`` [s]."""

    dt: float
    integration: Integration

    def velocity_and_position(self, zeta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """p_v [s] and p_u [s2] at points (n,) within the unit circle, (n,) each."""
        beta, gamma, mass_weight, force_weight = self.integration
        # The method's own acceleration, of which b is the balanced one.
        own = (1.0 - force_weight + force_weight * zeta) / (1.0 - mass_weight + mass_weight * zeta)
        velocity = self.dt * (gamma + (1.0 - gamma) * zeta) / (1.0 - zeta)
        position = self.dt * zeta * velocity + self.dt**2 * (beta + (0.5 - beta) * zeta)
        return own * velocity, own * position / (1.0 - zeta)


@dataclass(frozen=True)
class PeriodicEnd:
    """One end with a periodic line beyond, m shared unknowns.

    Attributes
    ----------
    beyond : the line beyond
    side : START or END
    damping : alpha [s] and beta [1/s] of C0 = alpha K0 + beta M0
    sums : displacement and velocity as sums over the accelerations of the steps
    mass, stiffness : (m, m) M0 and K0
    """

    beyond: LineBeyond
    side: int
    damping: tuple[float, float]
    sums: StepSums
    mass: np.ndarray
    stiffness: np.ndarray

    @property
    def unknowns(self) -> np.ndarray:
        """(m,) of the model, where it ends."""
        return self.beyond.unknowns

    def memory(self, n: int) -> np.ndarray:
        """Q_0 to Q_(n-1), (n, m, m): force by a unit acceleration j steps ago [N s2/m].

        Q_0 is zero, as the matrices contain it. Not collective.
        """
        size = fft.next_fast_len(max(2 * n, 16), real=True)
        radius = _ALIASED ** (1.0 / size)
        turns = np.arange(size // 2 + 1) / size
        zeta = radius * np.exp(-2j * np.pi * turns)
        m = self.unknowns.size
        values = np.empty((zeta.size, m, m), dtype=complex)
        for first in range(0, zeta.size, _AT_ONCE):
            part = zeta[first : first + _AT_ONCE]
            velocity, position = self.sums.velocity_and_position(part)
            alpha, beta = self.damping
            kept = np.multiply.outer(1.0 + beta * velocity, self.mass)
            kept += np.multiply.outer(position + alpha * velocity, self.stiffness)
            values[first : first + _AT_ONCE] = (
                half_line(self.beyond, self.side, np.ones_like(part), velocity, position) - kept
            )
        numbers = fft.irfft(values, size, axis=0)[:n]
        numbers /= (radius ** np.arange(n))[:, None, None]
        numbers[0] = 0.0
        return np.asarray(0.5 * (numbers + np.swapaxes(numbers, 1, 2)))


def half_line(
    beyond: LineBeyond, side: int, mass: np.ndarray, damping: np.ndarray, stiffness: np.ndarray
) -> np.ndarray:
    """Dynamic stiffness (n, m, m) of the line beyond a ``side``, ``START`` or ``END``.

    ``mass``, ``damping`` and ``stiffness`` (n,) are the real or complex factors of M, C and K.
    """
    weights = np.stack([mass, damping, stiffness], axis=1).astype(complex)
    after, before = half_lines(chain_at(beyond.span, weights))
    here = np.einsum("nw,wij->nij", weights, beyond.here)
    return (after if side == END else before) - here


def periodic_end(
    beyond: LineBeyond, side: int, damping: tuple[float, float], sums: StepSums
) -> PeriodicEnd:
    """The end of a line that goes on as ``beyond``. Not collective.

    Parameters
    ----------
    beyond : LineBeyond
        The half line beyond the end.
    side : int
        ``START`` or ``END``.
    damping : tuple of float
        alpha [s] and beta [1/s] of the line, for the part of its damping that the matrices contain.
    sums : StepSums
        Displacement and velocity as sums over the accelerations of the steps.

    Raises
    ------
    InputError
        If the response to a force at the end does not decay along the line.
    """
    zero, one = np.zeros(1), np.ones(1)
    stiffness = half_line(beyond, side, zero, zero, one)[0].real
    tau, sigma = sums.velocity_and_position(np.zeros(1))
    of_step = half_line(beyond, side, one, tau, sigma)[0].real
    alpha, beta = damping
    mass = (of_step - (sigma + tau * alpha) * stiffness) / (1.0 + tau * beta)
    return PeriodicEnd(beyond, side, damping, sums, _symmetric(mass), _symmetric(stiffness))


def _symmetric(matrix: np.ndarray) -> np.ndarray:
    return np.asarray(0.5 * (matrix + matrix.T))
