"""Which stretches of a line are alike, found from its elements before there are matrices.

Spans of a line are alike. A station's mark follows from all that stands in its rows of M, K and C:
the matrices of its elements, and which unknowns of this and of other stations these join. Stations
of one mark have the same rows, and stretches whose marks are the same have the same responses.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from catenary.solver.linear.unique_rows import digests
from catenary.solver.model.model import Model

# Odd numbers without a pattern: of Knuth's linear congruential generator and of SplitMix64.
_RATIO = 6364136223846793005
_FIRST, _SECOND = np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB)
# Sums of parts of so many bits are exact in float64, of up to 2^32 of them.
_BITS = 21


class LikeStations:
    """Marks of a line's stations. Not collective.

    Attributes
    ----------
    marks : (n,) uint64 of each
    """

    def __init__(self, model: Model) -> None:
        numbering = model.numbering
        starts = numbering.starts
        n = starts.size - 1
        station = np.repeat(np.arange(n), np.diff(starts))
        held = np.zeros(model.n_dofs, dtype=np.int64)
        held[model.constrained] = 1
        # What tells unknowns of a station from each other: their place in it, and whether one is
        # held.
        name = (2 * (np.arange(model.n_dofs) - starts[station]) + held).astype(np.uint64)
        self.marks = _mixed(numbering.make_up.astype(np.uint64))
        self.marks += _sums(station[model.constrained], _mixed(name[model.constrained]), n)
        for number, block in enumerate(model.blocks):
            if not block.dofs.size:
                continue  # of no element, as droppers that a line does not have
            # Which terms there are follows from the number of the block.
            terms = (block.mass, block.stiffness, block.damping)
            parts = [term.reshape(len(term), -1) for term in terms if term is not None]
            rows = np.concatenate(parts, axis=1)
            of_kind = _mixed(digests(rows) + np.uint64(number + 1))
            at, own = station[block.dofs], name[block.dofs]
            apart = (at - at.min(axis=1, keepdims=True)).astype(np.uint64)
            element = of_kind[block.kind]
            for column in range(at.shape[1]):
                element = _mixed(element + own[:, column] + (apart[:, column] << np.uint64(16)))
            for column in range(at.shape[1]):
                self.marks += _sums(at[:, column], _mixed(element + np.uint64(column)), n)

    def fingerprints(self, first: np.ndarray, last: np.ndarray) -> np.ndarray:
        """A number (k,) uint64 for each stretch from station ``first`` (k,) to before ``last``
        (k,), the same for stretches of the same marks."""
        sums, inverse = self._sums
        return (sums[last] - sums[first]) * inverse[first]

    @cached_property
    def _sums(self) -> tuple[np.ndarray, np.ndarray]:
        """Polynomials of the marks up to each station, and the powers that shift them back."""
        n = self.marks.size
        ratio, inverse = (np.full(n + 1, r, np.uint64) for r in (_RATIO, pow(_RATIO, -1, 2**64)))
        ratio[0] = inverse[0] = 1
        sums = np.zeros(n + 1, dtype=np.uint64)
        np.cumsum(self.marks * np.cumprod(ratio)[:n], out=sums[1:])
        return sums, np.cumprod(inverse)


def _mixed(numbers: np.ndarray) -> np.ndarray:
    """The finaliser of SplitMix64: numbers that tell nothing of what they follow from."""
    numbers = (numbers ^ (numbers >> np.uint64(30))) * _FIRST
    numbers = (numbers ^ (numbers >> np.uint64(27))) * _SECOND
    return np.asarray(numbers ^ (numbers >> np.uint64(31)))


def _sums(at: np.ndarray, numbers: np.ndarray, n: int) -> np.ndarray:
    """Sums (n,) uint64, modulo 2^64, of the ``numbers`` (k,) of each place ``at`` (k,)."""
    result = np.zeros(n, dtype=np.uint64)
    for shift in map(np.uint64, range(0, 64, _BITS)):
        part = (numbers >> shift) & np.uint64(2**_BITS - 1)
        result += np.bincount(at, weights=part, minlength=n).astype(np.uint64) << shift
    return result
