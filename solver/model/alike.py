"""Rows of a table that are the same, or the same but for rounding, found once.

Spans of a line are alike, so that its matrices have few unique rows, however long it is.
"""

from __future__ import annotations

import numpy as np

# Bits of numbers that are alike: those that follow are what rounding leaves of places along the
# line and of its shape at rest.
_EQUAL_BITS = 38
# Odd factors of the columns of rows, by which these are mixed.
_FACTORS = np.random.default_rng(0).integers(0, 2**63, 64, dtype=np.uint64) * np.uint64(2) + 1


def kinds_of(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """First row of each kind of ``rows`` (n, k), and the kind of each row (n,).

    Kinds are numbered as they are met, so that rows read theirs from memory mostly in order.
    """
    first, kinds = numbered(digests(rows))
    if not (rows == rows[first][kinds]).all():
        # Two different rows of one digest, as good as impossible, or what is no number.
        return np.arange(rows.shape[0]), np.arange(rows.shape[0], dtype=np.int32)
    return first, kinds


def numbered(marks: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """First of each kind of ``marks`` (n,), and the kind of each (n,) int32, as ``kinds_of``."""
    _, first, kinds = np.unique(marks, return_index=True, return_inverse=True)
    order = np.argsort(first)
    return first[order], np.argsort(order).astype(np.int32)[kinds]


def alike(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """``kinds_of`` rows that agree in all but their last bits; what is nothing beside the largest
    of a row counts as zero."""
    least = np.ldexp(np.abs(rows).max(axis=1, initial=0.0), -_EQUAL_BITS)[:, None]
    return kinds_of(rounded(np.where(np.abs(rows) < least, 0.0, rows), _EQUAL_BITS))


def rounded(numbers: np.ndarray, bits: int) -> np.ndarray:
    """Numbers with so many ``bits``, of the same shape."""
    mantissa, exponent = np.frexp(numbers)
    return np.ldexp(np.rint(np.ldexp(mantissa, bits)), exponent - bits)


def digests(rows: np.ndarray) -> np.ndarray:
    """A number (n,) uint64 for each of ``rows`` (n, k), the same for the same rows."""
    result = np.zeros(rows.shape[0], dtype=np.uint64)
    for number, column in enumerate((rows + 0.0).view(np.uint64).T):
        result = (result + column * _FACTORS[number % 64]) * _FACTORS[(7 * number + 1) % 64]
        result ^= result >> np.uint64(29)
    return result
