"""Reflection of waves of a periodic line by the end of the line.

At s = i omega + epsilon a wave of the periodic line grows with time and fades as it travels, by
exp(-epsilon L / v) a span of length L for the group velocity v. That divides waves that come from
those that go, and travelling ones from those that do not (principle of limiting absorption). An
incoming wave and all outgoing ones balance the forces where the end begins, whose spans answer with
their own stiffness. Amplitudes are those of unit energy flux. Droppers are taut; of damping there
is only that of absorbing layers, unless that of the line is included in both.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace

import numpy as np
from scipy import linalg

from catenary.base.errors import InputError
from catenary.solver.ends.half_lines import Chain, chain_at, half_lines
from catenary.solver.ends.line_beyond import END, START, shared_at, sideways, span_between
from catenary.solver.model.model import Model
from catenary.solver.problem.ends import AbsorbingLayer, Periodic

# epsilon [1/s], and the least group velocity of a wave that counts as one that travels [m/s], and
# what of its amplitude is left after a span.
_GROWTH, _SLOWEST, _LEFT = 1e-3, 2.0, 0.01


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
