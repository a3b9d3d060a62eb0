"""Bloch waves of a periodic line: its pass bands and group velocities.

A line whose spans are alike carries waves that are multiplied by exp(-i q) from span to span. For
each phase q the periods couple to K(q) = K_next exp(-i q) + K_own + K_previous exp(i q), and the
frequencies are the eigenvalues of K(q) phi = omega^2 M(q) phi. Frequencies that no q has do not
travel (L. Brillouin, Wave Propagation in Periodic Structures, 1946). Droppers are taut, and there
is no damping.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy import linalg

from catenary.base.errors import InputError
from catenary.meshgen.wires import Role
from catenary.solver.ends import matrices_between
from catenary.solver.model.model import Model

# Relative difference of the matrices of two spans that counts as none.
_ALIKE = 1e-9
# Phases q from 0 to pi at which waves are found, unless told otherwise.
N_PHASES = 49
# Waves up to so many times the highest frequency are found, so that branches are whole.
_MARGIN = 1.5
# Modes of a span that waves are made of, up to so many times the highest frequency: the error of
# a frequency is below (1 / 5)^4 of the share that modes above it have.
_MODES_UP_TO = 5.0
# That error, seen on a string, which has no gaps: 1e-4 at the highest frequency.
_GAP = 2e-4


@dataclass(frozen=True)
class Period:
    """One span of a periodic line and how it is joined to the next, n unknowns a span.

    Attributes
    ----------
    length : [m]
    stiffness, mass : (n, n) of its own unknowns [N/m], [kg] and so on
    stiffness_next, mass_next : (n, n) rows of its own unknowns, columns of the next span's
    contact : (m,) which of the unknowns are deflections of the contact wire
    contact_x : (m,) where these stand, from the start of the span [m]
    """

    length: float
    stiffness: np.ndarray
    mass: np.ndarray
    stiffness_next: np.ndarray
    mass_next: np.ndarray
    contact: np.ndarray
    contact_x: np.ndarray


@dataclass(frozen=True)
class BlochWaves:
    """Waves of a periodic line up to a frequency, p phases and b branches.

    Attributes
    ----------
    length : of a period [m]
    phase : (p,) from 0 to pi, both included [rad a period]
    frequency : (p, b) ascending in each row [Hz]
    group_velocity : (p, b) of travel of their energy [m/s], zero at the ends of a branch
    shape : (p, b, m) deflection of the contact wire at ``contact_x``, complex, largest value 1
    contact_x : (m,) [m]
    """

    length: float
    phase: np.ndarray
    frequency: np.ndarray
    group_velocity: np.ndarray
    shape: np.ndarray
    contact_x: np.ndarray

    def pass_bands(self, highest: float) -> np.ndarray:
        """Ranges of frequency up to ``highest`` [Hz] in which waves travel, (n, 2) [Hz].

        Ranges that overlap, or whose gap is below the error of the frequencies, are merged. Ends
        of branches lie at phases 0 and pi; where branches cross, a band's ends are accurate to
        the change of frequency between two phases.
        """
        low, high = self.frequency.min(axis=0), self.frequency.max(axis=0)
        merged: list[list[float]] = []
        for start, end in sorted(zip(low.tolist(), high.tolist(), strict=True)):
            if start > highest:
                break
            if merged and start <= (1.0 + _GAP) * merged[-1][1]:
                merged[-1][1] = max(merged[-1][1], end)
            else:
                merged.append([start, end])
        return np.array(merged).reshape(-1, 2)

    def fastest(self, highest: float) -> tuple[float, float]:
        """The greatest group velocity of waves up to a frequency [m/s], and the frequency of its
        wave [Hz]."""
        speed = np.where(self.frequency <= highest, np.abs(self.group_velocity), 0.0)
        at = np.unravel_index(speed.argmax(), speed.shape)
        return float(speed[at]), float(self.frequency[at])

    def harmonics(self, share: float = 0.1) -> np.ndarray:
        """Wavenumbers along the contact wire and frequencies of all waves, (n, 3).

        Rows are wavenumber [rad/m], frequency [Hz] and the amplitude [-] of exp(-i k x) in the
        wave's deflection, as far as it is at least ``share`` of the largest in a wave.
        """
        rows = []
        m = self.contact_x.size
        orders = np.arange(-(m // 2), m // 2 + 1)
        lengths = np.diff(np.append(self.contact_x, self.length))
        # Middle of the gaps on both sides of a node: the trapezoidal rule over a period.
        weight = 0.5 * (lengths + np.roll(lengths, 1)) / self.length
        for p, phase in enumerate(self.phase.tolist()):
            k = (phase + 2 * np.pi * orders) / self.length
            wave = np.exp(1j * np.outer(k, self.contact_x))
            amplitude = np.abs((self.shape[p] * weight) @ wave.T)
            for b, frequency in enumerate(self.frequency[p].tolist()):
                strong = amplitude[b] >= share * amplitude[b].max(initial=0.0)
                rows += [
                    (k_n, frequency, a)
                    for k_n, a in zip(
                        k[strong].tolist(), amplitude[b, strong].tolist(), strict=True
                    )
                ]
        return np.array(rows).reshape(-1, 3)


def period_of(model: Model, start: float, end: float) -> Period:
    """The span of a line from ``start`` to ``end`` [m], as one of many. Not collective.

    Raises
    ------
    InputError
        If the spans on both sides of it are not like it.
    """
    unknowns = model.numbering
    length = end - start
    starts = [unknowns.first_at(x) for x in (start - length, start, end, end + length)]
    if len(set(np.diff(starts).tolist())) > 1:
        raise InputError(
            f"the spans beside that from {start:g} to {end:g} m have other nodes: the waves of a "
            "periodic line need spans that are alike"
        )
    first, after, last = starts[1:]
    mass, _, stiffness = matrices_between(model, first, after, first, last)
    mass_beside, _, stiffness_beside = matrices_between(model, after, last, after, last)
    size = after - first
    for both, beside in ((mass, mass_beside), (stiffness, stiffness_beside)):
        if np.abs(both[:, :size] - beside).max() > _ALIKE * np.abs(both[:, :size]).max():
            raise InputError(
                f"the span from {start:g} to {end:g} m is not like the next one: the waves of a "
                "periodic line need spans that are alike"
            )
    contact = model.problem.line.wires_of(Role.CONTACT)[0]
    nodes = np.unique(model.mesh.elements(contact.name))
    numbers, x = unknowns.of(nodes, "w"), model.mesh.x(nodes)
    inside = np.flatnonzero((numbers >= starts[1]) & (numbers < starts[2]))
    inside = inside[np.argsort(x[inside])]
    return Period(
        length,
        stiffness[:, :size],
        mass[:, :size],
        stiffness[:, size:],
        mass[:, size:],
        (numbers[inside] - first).astype(np.int64),
        x[inside] - start,
    )


def bloch_waves(period: Period, highest: float) -> BlochWaves:
    """The waves of a periodic line up to a frequency [Hz]. Not collective.

    Branches that begin below ``highest`` are whole.
    """
    # Missing and held unknowns have no mass, and are no part of a wave.
    free = np.flatnonzero(np.diag(period.mass) > 0.0)
    pick = np.ix_(free, free)
    spans = _Spans(
        period.stiffness[pick], period.stiffness_next[pick], period.mass[pick],
        period.mass_next[pick],
    )  # fmt: skip
    at = np.searchsorted(free, period.contact)
    reduced = spans.reduced((2 * np.pi * _MODES_UP_TO * highest) ** 2)
    own, turned = reduced.own[at], reduced.turned[at]
    phase = np.linspace(0.0, np.pi, N_PHASES)
    above = (2 * np.pi * _MARGIN * highest) ** 2
    found = []
    for q in phase.tolist():
        squares, weights, slope = reduced.waves(q, above)
        omega = np.sqrt(np.maximum(squares, 0.0))
        velocity = period.length * slope / np.maximum(2 * omega, 1e-9)
        shapes = (own + np.exp(-1j * q) * turned) @ weights
        found.append((omega / (2 * np.pi), velocity, shapes))
    n_all = min(row[0].size for row in found)
    frequency = np.array([row[0][:n_all] for row in found])
    n = int((frequency.min(axis=0) <= highest).sum())
    shape = np.array([row[2][:, :n].T for row in found])
    largest = np.abs(shape).max(axis=2, keepdims=True)
    return BlochWaves(
        period.length,
        phase,
        frequency[:, :n],
        np.array([row[1][:n] for row in found]),
        shape / np.where(largest > 0.0, largest, 1.0),
        period.contact_x,
    )


@dataclass(frozen=True)
class _Spans:
    """K and M of a span and its coupling with the next, (n, n) each."""

    k: np.ndarray
    k_next: np.ndarray
    m: np.ndarray
    m_next: np.ndarray

    def reduced(self, up_to: float) -> _ReducedSpans:
        """The spans with the modes up to omega^2 ``up_to`` (R. Craig, M. Bampton, AIAA J. 6, 1968).

        A wave is a sum of static shapes of a span under unit displacements at its start, and
        exp(-i q) times as much at its end, and of its modes with both held.
        """
        n = self.k.shape[0]
        joined = self.k_next.any(axis=0) | self.m_next.any(axis=0)
        shared, inner = np.flatnonzero(joined), np.flatnonzero(~joined)
        stiffness, mass = (part[np.ix_(inner, inner)] for part in (self.k, self.m))
        _, modes = linalg.eigh(stiffness, mass, subset_by_value=(-np.inf, up_to))
        own, turned = np.zeros((2, n, shared.size + modes.shape[1]))
        at_start, at_modes = np.arange(shared.size), slice(shared.size, None)
        own[shared, at_start] = 1.0
        beside = [self.k[np.ix_(inner, shared)], self.k_next[np.ix_(inner, shared)]]
        for shapes, forces in zip((own, turned), beside, strict=True):
            shapes[inner, : shared.size] = -linalg.solve(stiffness, forces, assume_a="pos")
        own[inner, at_modes] = modes
        return _ReducedSpans(
            own,
            turned,
            _Reduced.of(self.k, self.k_next, own, turned),
            _Reduced.of(self.m, self.m_next, own, turned),
        )


class _Reduced(NamedTuple):
    """A matrix A + t B + B^T / t, with t = exp(-i q), in the shapes S_0 + t S_1, (r, r) each.

    It is Y + Y^H with Y = still + t once + t^2 twice. ``coupling`` is S_0^T B S_0 + S_1^T B S_1,
    ``back`` S_1^T B S_0.
    """

    still: np.ndarray
    once: np.ndarray
    twice: np.ndarray
    coupling: np.ndarray
    back: np.ndarray

    @classmethod
    def of(cls, a: np.ndarray, b: np.ndarray, own: np.ndarray, turned: np.ndarray) -> _Reduced:
        """From A and B, (n, n) each, and S_0 and S_1, (n, r) each."""
        coupling = own.T @ b @ own + turned.T @ b @ turned
        back = turned.T @ b @ own
        still = 0.5 * (own.T @ a @ own + turned.T @ a @ turned) + back
        return cls(still, own.T @ a @ turned + coupling, own.T @ b @ turned, coupling, back)

    def at(self, t: complex) -> np.ndarray:
        """The matrix (r, r) at t."""
        half = self.still + t * self.once + t**2 * self.twice
        return half + half.conj().T

    def by_phase(self, t: complex, weights: np.ndarray) -> np.ndarray:
        """Derivatives (w,) by q of the matrix in waves of ``weights`` (r, w), which are kept."""
        joined = self.coupling + t * self.twice + np.conj(t) * self.back
        return 2.0 * np.einsum("iw,iw->w", weights.conj(), -1j * t * joined @ weights).real


class _ReducedSpans(NamedTuple):
    """Shapes of a span and shapes that turn by a phase, (n, r) each, and its matrices in them."""

    own: np.ndarray
    turned: np.ndarray
    stiffness: _Reduced
    mass: _Reduced

    def waves(self, q: float, above: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """omega^2 (w,) up to ``above``, weights (r, w) of the shapes, and d omega^2 / d q (w,) at a
        phase q."""
        t = np.exp(-1j * q)
        squares, weights = linalg.eigh(
            self.stiffness.at(t), self.mass.at(t), subset_by_value=(-np.inf, above)
        )
        of_stiffness, of_mass = (part.by_phase(t, weights) for part in (self.stiffness, self.mass))
        return squares, weights, of_stiffness - squares * of_mass
