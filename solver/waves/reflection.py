"""Reflection of waves: by single obstacles on tensioned wires, and by the end of a periodic line.

Obstacles have closed forms. A wire is a beam of bending stiffness EI under the tension T, of mass m
a length. Waves are exp(i (w t - k x)), with EI k^4 + T k^2 = m w^2; beside them there is what falls
off as exp(-q |x|), q^2 = k^2 + T / EI. A unit force at x = 0 makes

    w(x) = g exp(-i k |x|) - n exp(-q |x|),     g = 1 / (2 i k s),  n = 1 / (2 q s),
    s = EI (k^2 + q^2) .

An obstacle that answers a deflection with the force D, as a spring, a mass or a damper does, makes
of a wave a share R of it that comes back and 1 + R that goes on,

    R = -g D / (1 + (g - n) D),     a string: R = -D / (D + 2 i w Z),  Z = sqrt(T m) .

Obstacles that join several wires, such as droppers, have matrices in place of D and R.

Of an end, at s = i omega + epsilon a wave of the periodic line grows with time and fades as it
travels, by exp(-epsilon L / v) a span of length L for the group velocity v. That divides waves that
come from those that go, and travelling ones from those that do not (principle of limiting
absorption). An incoming wave and all outgoing ones balance the forces where the end begins, whose
spans answer with their own stiffness. Amplitudes are those of unit energy flux. Droppers are taut;
of damping there is only that of absorbing layers, unless that of the line is included in both.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy import linalg

from catenary.base.errors import InputError
from catenary.meshgen.wires import Conductor
from catenary.solver.ends import (
    END,
    START,
    Chain,
    chain_at,
    half_lines,
    shared_at,
    sideways,
    span_between,
)
from catenary.solver.model.model import Model
from catenary.solver.problem.ends import AbsorbingLayer, Periodic

# epsilon [1/s], and the least group velocity of a wave that counts as one that travels [m/s], and
# what of its amplitude is left after a span.
_GROWTH, _SLOWEST, _LEFT = 1e-3, 2.0, 0.01


class Answer(NamedTuple):
    """Waves that a unit force at one place of a wire makes, at f frequencies.

    Attributes
    ----------
    wavenumber, decay : k and q (f,) [rad/m], [1/m]
    wave, near : g and n (f,) [m/N]
    """

    wavenumber: np.ndarray
    decay: np.ndarray
    wave: np.ndarray
    near: np.ndarray


def answer_of(wire: Conductor, omega: np.ndarray) -> Answer:
    """The answer of an endless wire at angular frequencies (f,), positive [1/s].

    Without bending stiffness nothing falls off but at once.
    """
    tension, bending = wire.tension, wire.bending_stiffness
    inertia = wire.mass_per_length * omega**2
    # The smaller root in a form that has a limit for no bending.
    square = 2.0 * inertia / (tension + np.sqrt(tension**2 + 4.0 * bending * inertia))
    k = np.sqrt(square)
    slope = tension + 2.0 * bending * square
    if bending == 0.0:
        none = np.zeros_like(k)
        return Answer(k, np.full_like(k, np.inf), 1.0 / (2j * k * slope), none)
    q = np.sqrt(square + tension / bending)
    return Answer(k, q, 1.0 / (2j * k * slope), 1.0 / (2.0 * q * slope))


def scattered(
    wires: tuple[Conductor, ...], omega: np.ndarray, resistance: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Shares of waves that come back from an obstacle, and that go on beyond it.

    Parameters
    ----------
    wires : tuple of Conductor
        Wires that the obstacle joins.
    omega : ndarray, shape (f,)
        Angular frequencies [1/s].
    resistance : ndarray, shape (f, n, n)
        Matrices D, forces of the obstacle against unit deflections of the wires [N/m].

    Returns
    -------
    back, onward : (f, n, n) complex, amplitude on the wire of the row of a unit wave on that of the
        column
    """
    answers = [answer_of(wire, omega) for wire in wires]
    one = np.eye(len(wires))
    wave = np.stack([a.wave for a in answers], axis=1)[:, :, None] * one
    whole = np.stack([a.wave - a.near for a in answers], axis=1)[:, :, None] * one
    # Forces f = -D u on the wires, u = e + (g - n) f for the deflection e that comes in.
    force = -np.linalg.solve(one + resistance @ whole, resistance)
    back = wave @ force
    return back, one + back


def change_of_wire(
    first: Conductor, second: Conductor, omega: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Shares of a wave on ``first`` that come back from where it becomes ``second``, and go on.

    Amplitudes (f,) complex at the angular frequencies ``omega`` (f,) [1/s]. Both wires have bending
    stiffness; deflection, slope, moment and vertical force are continuous. For strings the
    amplitudes are (Z1 - Z2) / (Z1 + Z2) and 2 Z1 / (Z1 + Z2).
    """
    one, two = answer_of(first, omega), answer_of(second, omega)
    # exp(-i k x) on the left, R exp(i k x) + N exp(q x) there, T exp(-i k x) + M exp(-q x) beyond.
    exponents = [1j * one.wavenumber, one.decay + 0j, -1j * two.wavenumber, -two.decay + 0j]
    kinds = [first, first, second, second]
    signs = [1.0, 1.0, -1.0, -1.0]
    columns = [sign * _at_joint(a, w) for a, w, sign in zip(exponents, kinds, signs, strict=True)]
    incoming = _at_joint(-1j * one.wavenumber, first)
    found = np.linalg.solve(np.stack(columns, axis=2), -incoming[:, :, None])[:, :, 0]
    return found[:, 0], found[:, 2]


def _at_joint(exponent: np.ndarray, wire: Conductor) -> np.ndarray:
    """Deflection, slope, moment and vertical force of exp(a x) at x = 0, (f, 4)."""
    a, bending = exponent, wire.bending_stiffness
    return np.stack([np.ones_like(a), a, bending * a**2, wire.tension * a - bending * a**3], axis=1)


@dataclass(frozen=True)
class EndReflection:
    """Reflection by an end, f frequencies and m waves that may come at each.

    Attributes
    ----------
    frequency : (f,) [Hz]
    group_velocity : (f, m) of the waves that come, NaN where there are fewer [m/s]
    reflected : (f, m) amplitude of all that goes back, in the root of the energy [-]
    """

    frequency: np.ndarray
    group_velocity: np.ndarray
    reflected: np.ndarray

    def of_faster(self, speed: float) -> tuple[float, float]:
        """Largest and rms reflection of waves faster than ``speed`` [m/s]; NaN if none is."""
        found = self.reflected[self.group_velocity > speed]
        if not found.size:
            return np.nan, np.nan
        return float(found.max()), float(np.sqrt((found**2).mean()))

    def energy_of_faster(self, speed: float) -> tuple[float, float]:
        """Largest and mean reflected share of the energy of waves faster than ``speed`` [m/s].

        All waves carry the same energy at all frequencies; NaN if none is faster.
        """
        largest, rms = self.of_faster(speed)
        return largest**2, rms**2


def end_reflection(model: Model, side: int, frequency: np.ndarray) -> EndReflection:
    """Reflection by the ``START`` or ``END`` of a model at frequencies (f,) [Hz]. Not collective.

    ``side`` is ``START`` or ``END``. The line before the end is taken as periodic, with the span
    next to the end. Both have the line's damping, alpha and beta of the whole; it acts from where
    the end begins. Waves that it reduces to less than a hundredth within a span are left out.

    Raises
    ------
    InputError
        If spans are joined by more than a cross-section at a mast, or there is none before the end.
    """
    damping = model.simulated.damping
    whole = replace(model, constrained=model.numbering.missing)
    s = _GROWTH + 2j * np.pi * frequency
    weights = np.stack([s**2, s, np.ones_like(s)], axis=1)
    line, end = model.problem.line, model.problem.ends[side]
    # From the end inwards.
    masts = line.support_positions[:: -1 if side == END else 1]
    n_end = end.n_spans if isinstance(end, AbsorbingLayer) else 1
    if len(masts) < n_end + 2:
        raise InputError("a line needs two spans (line.n_spans) for waves that come to its end")
    signs = _signs(whole, masts[n_end:], weights[:1])
    incoming = _chain(whole, masts[n_end + 1], masts[n_end], weights, signs)
    after, before = half_lines(incoming)
    if isinstance(end, Periodic):
        answer = after
    else:
        answer = _held(whole, model, side, masts[: n_end + 2], weights) * signs[:, None] * signs
    fading = _GROWTH + 0.5 * (damping.beta + damping.alpha * np.abs(s) ** 2)
    length = fading * abs(masts[n_end + 1] - masts[n_end])
    return _reflection(frequency, incoming, after, before, answer, length)


def _signs(model: Model, masts: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """-1 for unknowns shared at a mast that are the other way round at the next one, 1 for others.

    Lateral ones are so where spans are mirror images in turn, as those of a zig-zag: with the
    cross-section at every second mast the other way round all spans are alike. ``masts`` are from
    the end inwards.
    """
    unknowns, _ = span_between(model, *sorted(masts[:2]))
    signs, none = sideways(model, unknowns), np.ones(unknowns.size)
    if len(masts) < 3 or (signs > 0.0).all():
        return none
    ours, other = (_chain(model, masts[i + 1], masts[i], weights, none).next[0] for i in range(2))
    image = other * signs[:, None] * signs
    return signs if np.abs(ours - image).max() < np.abs(ours - other).max() else none


def _chain(
    model: Model, inner: float, outer: float, weights: np.ndarray, signs: np.ndarray | None = None
) -> Chain:
    """A span towards an end, its first mast being the ``inner`` one; ``corner`` is that of its
    first mast along the track. Unknowns at the outer mast are multiplied by ``signs``."""
    chain = chain_at(span_between(model, min(inner, outer), max(inner, outer))[1], weights)
    if signs is None:
        signs = np.ones(chain.corner.shape[1])
    both = signs[:, None] * signs
    if inner < outer:
        return Chain(chain.corner, chain.start, chain.end * both, chain.next * signs)
    joined = np.swapaxes(chain.next * signs[:, None], 1, 2)
    return Chain(chain.corner * both, chain.end, chain.start * both, joined)


def _held(
    whole: Model, model: Model, side: int, masts: np.ndarray, weights: np.ndarray
) -> np.ndarray:
    """Dynamic stiffness (n, m, m) at the last but one of ``masts``, which are from the end inwards,
    of the spans between them; held at the first. The last one is that of the span before."""
    unknowns = _unknowns_at(whole, side, masts)
    answer = _last_span(whole, model, side, unknowns[0], weights)
    for number in range(2, len(masts) - 1):
        chain = _chain(whole, masts[number], masts[number - 1], weights)
        outer = answer - chain.end
        answer = _at(whole, unknowns[number - 1], weights) - chain.start
        joined = np.linalg.solve(outer, np.swapaxes(chain.next, 1, 2))
        answer = answer - chain.next @ joined
    return answer


def _last_span(
    whole: Model, model: Model, side: int, shared: np.ndarray, weights: np.ndarray
) -> np.ndarray:
    """Dynamic stiffness (n, m, m) of the last span at the unknowns that it shares with the one
    before; some wires, such as stitch wires, may not reach into it."""
    beyond = np.arange(shared[0]) if side == START else np.arange(shared[0], whole.numbering.size)
    beyond = np.setdiff1d(beyond, [*shared, *model.constrained])
    every = np.union1d(shared, beyond)
    parts = shared_at(whole, every)
    inner, outer = np.isin(every, beyond), np.isin(every, shared)
    row, column = np.nonzero(parts[:, inner][:, :, inner].any(axis=0))
    width = int(np.abs(row - column).max())
    bands = np.zeros((len(parts), 2 * width + 1, beyond.size))
    bands[:, width + row - column, column] = parts[:, inner][:, :, inner][:, row, column]
    joins = parts[:, inner][:, :, outer]
    answer = _at(whole, shared, weights)
    for number, weight in enumerate(weights):
        banded, right = (np.tensordot(weight, part, 1) for part in (bands, joins))
        answer[number] -= right.T @ linalg.solve_banded((width, width), banded, right)
    return answer


def _unknowns_at(model: Model, side: int, masts: np.ndarray) -> list[np.ndarray]:
    """Unknowns that spans share at each mast but the first and the last, which are from the end
    inwards: those at the mast inwards are alike."""
    found = []
    for mast, inner in itertools.pairwise(masts[1:]):
        unknowns, _ = span_between(model, *sorted((mast, inner)))
        away = model.numbering.first_at(mast) - model.numbering.first_at(inner)
        found.append(unknowns + (away if side == END else 0))
    return found


def _at(model: Model, unknowns: np.ndarray, weights: np.ndarray) -> np.ndarray:
    return np.asarray(np.einsum("nw,wij->nij", weights, shared_at(model, unknowns)))


def _reflection(
    frequency: np.ndarray,
    line: Chain,
    after: np.ndarray,
    before: np.ndarray,
    answer: np.ndarray,
    fading: np.ndarray,
) -> EndReflection:
    m = after.shape[1]
    velocity, reflected = np.full((2, frequency.size, m), np.nan)
    for i in range(frequency.size):
        ahead, back = line.next[i], line.next[i].T
        factors, waves = np.linalg.eig(-np.linalg.solve(after[i] - line.end[i], back))
        inwards = -np.linalg.solve(before[i] - line.start[i], ahead)
        _, leaving = np.linalg.eig(inwards)
        speed = -fading[i] / np.log(np.maximum(np.abs(factors), 1e-300))
        here = answer[i] - line.end[i]
        # Imaginary parts are energy that goes by, in either direction.
        out = _flux(leaving, before[i])
        for w in np.flatnonzero((speed > _SLOWEST) & (np.abs(factors) > _LEFT)):
            wave = waves[:, w]
            come = back @ wave / factors[w] + here @ wave
            gone = np.linalg.solve(leaving, np.linalg.solve(back @ inwards + here, -come))
            share = (np.abs(gone) ** 2 * out).sum() / _flux(waves[:, [w]], after[i])[0]
            velocity[i, w], reflected[i, w] = speed[w], np.sqrt(max(share, 0.0))
    return EndReflection(frequency, velocity, reflected)


def _flux(waves: np.ndarray, stiffness: np.ndarray) -> np.ndarray:
    """Energy flux of waves (m, k) into a half line, over half the angular frequency."""
    return np.asarray(np.einsum("ik,ij,jk->k", waves.conj(), stiffness, waves).imag)
