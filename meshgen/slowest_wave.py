"""The slowest wave of a contact wire: the train's speed at which its force gathers energy.

A wire that hangs on droppers is a string, whose long waves run at sqrt(F / m). Supports that carry
the wire itself every L metres, as those of a conductor rail, let no longer waves through. A wave of
phase q a span has w(q), the least root of

    1 + (k_s - m_s w^2) / L sum_n 1 / (F k_n^2 + EI k_n^4 - m w^2) = 0,   k_n = (q + 2 pi n) / L

(D. J. Mead, J. Sound Vib. 11, 1970), the lower edge of the pass bands at q = pi. A load that moves
at v excites w = v k, k = q / L or (2 pi - q) / L; what it excites stays with it where that line
touches w(k), at the least phase speed w / k. On supports that give way to long waves this is the
critical speed of a beam on an elastic foundation, sqrt(F / m + 2 sqrt(EI k_s / L) / m); on stiff
ones 0.92 to 1 of sqrt(F / m + EI (pi / L)^2 / m); sqrt(F / m) on a string.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from catenary.meshgen.line import Line
from catenary.meshgen.wires import Role, Wire

# A wave that much faster than a string's is one of bending [-].
_BENDS = 1.01
# Phases of a span from 0 to pi, and wavenumbers on both sides of the first: the shape of a beam is
# the sum of theirs to 1 / (2 pi 10)^4.
_PHASES, _ORDERS = 257, 10


def slowest_wave(line: Line, shares: Mapping[str, float] | None = None) -> float:
    """Slowest wave of the contact wires of a line [m/s].

    Parameters
    ----------
    line : Line
        The wires and their supports.
    shares : mapping, optional
        Share of its tension that each wire has, by name; 1 for others [-].
    """
    of = shares or {}
    wires = line.wires_of(Role.CONTACT)
    return min(slowest_wave_of(line, wire, of.get(wire.name, 1.0)) for wire in wires)


def slowest_wave_of(line: Line, wire: Wire, share: float = 1.0) -> float:
    """Slowest wave of one wire of a line with a share of its tension [m/s].

    Of supports that are not alike it takes the longest span, the softest spring and the heaviest
    arm, so that no span has a slower wave. Where bending makes it no faster than a string by more
    than a hundredth, it is sqrt(F / m), as in EN 50119.
    """
    tension = share * wire.tension
    string = float(np.sqrt(tension / wire.mass_per_length))
    groups = [group for group in line.supports if group.wire == wire.name and group.x]
    if not groups:
        return string
    ends = [x for piece in wire.pieces for x in (piece.x[0], piece.x[-1])]
    places = np.unique([*ends, *(x for group in groups for x in group.x)])
    span = float(np.diff(places).max())
    # On supports that give way or have mass no wave of two spans is faster than with its nodes at
    # the supports. Where that one does not bend, the slowest does not either.
    bound = wave_of_two_spans(tension, wire.bending_stiffness, wire.mass_per_length, span).phase
    if not bends(bound, tension, wire.mass_per_length):
        return string
    arms = [arms.kind for arms in line.steady_arms if arms.wire == wire.name]
    found = supported_wave(
        tension,
        wire.bending_stiffness,
        wire.mass_per_length,
        span,
        min(group.stiffness for group in groups),
        max((arm.mass_per_length * arm.length / 3 + arm.clamp_mass for arm in arms), default=0.0),
    )
    return found if bends(found, tension, wire.mass_per_length) else string


@lru_cache(maxsize=64)
def supported_wave(
    tension: float,
    bending_stiffness: float,
    mass_per_length: float,
    span: float,
    stiffness: float,
    mass: float = 0.0,
) -> float:
    """Slowest wave of an endless wire on like supports [m/s].

    Parameters
    ----------
    tension, bending_stiffness, mass_per_length : float
        Tension, bending stiffness and mass per length of the wire [N], [N m2], [kg/m].
    span : float
        Span between supports [m].
    stiffness, mass : float
        Stiffness and mass of each support [N/m], [kg].
    """
    q = np.linspace(0.0, np.pi, _PHASES)
    orders = np.arange(-_ORDERS, _ORDERS + 1)
    square = ((q[:, None] + 2 * np.pi * orders) / span) ** 2
    alone = square * (tension + bending_stiffness * square) / mass_per_length
    # Amplitudes a_n of the wavenumbers: (alone + stiff 1 1^T) a = w^2 (I + heavy 1 1^T) a.
    stiff, heavy = (part / (mass_per_length * span) for part in (stiffness, mass))
    n = orders.size
    root = np.eye(n) + ((1.0 + heavy * n) ** -0.5 - 1.0) / n
    matrix = root @ (alone[:, :, None] * np.eye(n) + stiff) @ root
    omega = np.sqrt(np.maximum(np.linalg.eigvalsh(matrix)[:, 0], 0.0))
    return slowest_phase_speed(q, omega, span)


def slowest_phase_speed(phase: np.ndarray, omega: np.ndarray, span: float) -> float:
    """Least phase speed w / k of the lowest branch of a periodic line's waves [m/s].

    For k from 0 to pi / L it is the least of all; beyond, where w(k) falls again unless supports
    are stiff, only a speed at which a line w = v k touches the branch counts.

    Parameters
    ----------
    phase : ndarray, shape (p,)
        Phases, ascending from 0 to pi [rad a span].
    omega : ndarray, shape (p,)
        Angular frequencies of the branch [rad/s].
    span : float
        Span between supports [m].
    """
    k = np.concatenate([phase[1:], 2 * np.pi - phase[-2::-1]]) / span
    speed = np.concatenate([omega[1:], omega[-2::-1]]) / k
    inner = speed[1:-1]
    touches = (inner < speed[:-2]) & (inner < speed[2:]) & (k[1:-1] * span > np.pi)
    return float(min([*speed[: phase.size - 1], *inner[touches]]))


class LongWave(NamedTuple):
    """Speeds of a wave: of its phase and of its energy [m/s]."""

    phase: float
    energy: float


def wave_of_two_spans(
    tension: float, bending_stiffness: float, mass_per_length: float, span: float
) -> LongWave:
    """The wave of a wire that is as long as two spans, which like supports let through.

    Parameters
    ----------
    tension, bending_stiffness, mass_per_length : float
        Tension, bending stiffness and mass per length of the wire [N], [N m2], [kg/m].
    span : float
        Span between supports [m].
    """
    bending = bending_stiffness * (np.pi / span) ** 2
    phase = float(np.sqrt((tension + bending) / mass_per_length))
    return LongWave(phase, (tension + 2.0 * bending) / (mass_per_length * phase))


def bends(speed: float, tension: float, mass_per_length: float) -> bool:
    """Whether a slowest wave of ``speed`` [m/s] is one of bending, not that of a string.

    ``tension`` [N] and ``mass_per_length`` [kg/m] are those of the wire.
    """
    return speed > _BENDS * float(np.sqrt(tension / mass_per_length))
