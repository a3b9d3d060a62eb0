"""A periodic half line as seen from its end: the stiffness of all spans beyond, at any frequency.

Spans that are alike, each condensed to the unknowns that it shares with the next one, make a chain

    B u_(j-1) + S u_j + B^T u_(j+1) = f_j .

Condensing every second one of these leaves a chain of spans twice as long, whose coupling falls
with the square each time as soon as waves fade along it (cyclic reduction; R. W. Hockney, J. ACM
12, 1965). What is left at the first one is the stiffness of the half line.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from catenary.base.errors import InputError
from catenary.solver.kernels import native

# Coupling over diagonal at which the rest of a half line is round-off, squared in another pass; and
# the most passes: spans are 2^40 times as long then.
_ROUND_OFF, _MOST_PASSES = 1e-9, 40
# Unknowns that an element may join, twice a station's: four in lateral motion of six wires.
_MOST_WIDE = 47


class SpanMatrices(NamedTuple):
    """A span between two cross-sections, c + m unknowns: M, C and K, one after the other.

    The m unknowns that a span shares with the one before it stand apart from its c others, which
    are ordered along the track.

    Attributes
    ----------
    bands : (3, c, b + 1) lower bands of the c others: ``bands[:, r, b - d]`` joins r and r - d
    start, end : (3, c, m) coupling of the c others to the m unknowns at the start and at the end
    corner : (3, m, m) block of the m unknowns at the start, contributions of both spans summed
    across : (3, m, m) direct coupling of the start (rows) to the end (columns)
    """

    bands: np.ndarray
    start: np.ndarray
    end: np.ndarray
    corner: np.ndarray
    across: np.ndarray


class Chain(NamedTuple):
    """Spans condensed to their m shared unknowns, at n frequencies.

    Attributes
    ----------
    corner : (n, m, m) dynamic stiffness of the shared unknowns before condensation
    start, end : (n, m, m) reduction of ``corner`` by condensing a span, at its start and at its end
    next : (n, m, m) coupling of a cross-section (rows) to the next one (columns)
    """

    corner: np.ndarray
    start: np.ndarray
    end: np.ndarray
    next: np.ndarray


def span_matrices(own: np.ndarray, joined: np.ndarray, shared: np.ndarray) -> SpanMatrices:
    """A span in the form that is condensed.

    Parameters
    ----------
    own : ndarray, shape (3, n, n)
        Matrices of the span's unknowns.
    joined : ndarray, shape (3, n, n)
        Rows of these with columns of the next span's.
    shared : ndarray, shape (m,)
        Unknowns that the span shares with the one before.

    Raises
    ------
    InputError
        If spans share more than what is shared with the one before.
    """
    if np.delete(joined, shared, axis=2).any():
        raise InputError("its spans are joined by more than one cross-section")
    others = np.setdiff1d(np.flatnonzero(own[0].diagonal() > 0.0), shared)
    inner = own[:, others][:, :, others]
    rows, columns = np.nonzero(inner.any(axis=0))
    width = int(np.abs(rows - columns).max(initial=0))
    if width > _MOST_WIDE:
        raise InputError("its nodes do not stand side by side")
    bands = np.zeros((3, others.size, width + 1))
    for d in range(width + 1):
        bands[:, d:, width - d] = np.diagonal(inner, -d, axis1=1, axis2=2)
    return SpanMatrices(
        bands,
        np.ascontiguousarray(own[:, others][:, :, shared]),
        np.ascontiguousarray(joined[:, others][:, :, shared]),
        np.ascontiguousarray(own[:, shared][:, :, shared]),
        np.ascontiguousarray(joined[:, shared][:, :, shared]),
    )


def chain_at(span: SpanMatrices, weights: np.ndarray) -> Chain:
    """Spans condensed at n frequencies; ``weights`` (n, 3) are complex factors of M, C and K."""
    m = span.corner.shape[1]
    taken = np.zeros((weights.shape[0], 2 * m, 2 * m), dtype=complex)
    beside = np.concatenate([span.start, span.end], axis=2)
    native.condense_spans(weights, span.bands, beside, taken)
    corner, across = (
        np.einsum("nw,wij->nij", weights, part) for part in (span.corner, span.across)
    )
    return Chain(corner, taken[:, :m, :m], taken[:, m:, m:], across - taken[:, :m, m:])


def half_lines(chain: Chain) -> tuple[np.ndarray, np.ndarray]:
    """Stiffness of the half lines after and before a cross-section, (n, m, m) each.

    Each includes ``corner``, to which the elements on both sides of the cross-section contribute.

    Raises
    ------
    InputError
        If the response to a force there does not decay along the line at one of the frequencies.
    """
    after, before = chain.corner - chain.start, chain.corner - chain.end
    here = after - chain.end
    ahead, back = chain.next, np.swapaxes(chain.next, 1, 2)
    for _ in range(_MOST_PASSES):
        # Slopes and deflections differ in unit: products of coupling are compared, not coupling.
        to_ahead, to_back = np.linalg.solve(here, ahead), np.linalg.solve(here, back)
        forth, round_trip = ahead @ to_back, back @ to_ahead
        after, before = after - forth, before - round_trip
        here = here - forth - round_trip
        ahead, back = -ahead @ to_ahead, -back @ to_back
        left = np.abs(forth).max(axis=(1, 2)) / np.abs(after).max(axis=(1, 2))
        if left.max() < _ROUND_OFF**2:
            return after, before
    raise InputError("what acts on one of its cross-sections does not fade along it")
