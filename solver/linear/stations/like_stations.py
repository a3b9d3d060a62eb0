"""Like stretches of a line, found from its elements before there are matrices.

Spans of a line are alike. A station's mark follows from all that stands in its rows of M, K and C:
the matrices of its elements, and which unknowns of this and of other stations these join. Stations
of one mark have the same rows, and stretches whose marks are the same have the same responses.
"""

from __future__ import annotations

import math
from functools import cached_property

import numpy as np

from catenary.solver.model.alike import digests
from catenary.solver.model.model import Block, Model

# Odd numbers without a pattern: of Knuth's linear congruential generator and of SplitMix64.
_RATIO = 6364136223846793005
_FIRST, _SECOND = np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB)


class LikeStations:
    """Marks of a line's stations. Not collective.

    Attributes
    ----------
    first : the first of them
    marks : (n,) uint64 of each

    Parameters
    ----------
    first, last : range of stations that have marks, all of the line if not given
    """

    def __init__(self, model: Model, first: int = 0, last: int | None = None) -> None:
        numbering = model.numbering
        last = numbering.starts.size - 1 if last is None else last
        starts = numbering.starts[first : last + 1]
        self.first, n = first, last - first
        low, high = int(starts[0]), int(starts[-1])
        station = np.repeat(np.arange(n), np.diff(starts))
        held = np.zeros(high - low, dtype=np.int64)
        constrained = model.constrained_between(low, high) - low
        held[constrained] = 1
        # Unknowns of a station differ by their place in it and by whether they are held.
        name = (2 * (np.arange(low, high) - starts[station]) + held).astype(np.uint64)
        self.marks = _mixed(numbering.station_type[first:last].astype(np.uint64))
        np.add.at(self.marks, station[constrained], _mixed(name[constrained]))
        for number, block in enumerate(model.blocks):
            dofs, kind, table = _elements_between(block, low, high)
            if not dofs.size:
                continue  # of no element, as droppers that a line does not have
            of_kind = _mixed(digests(table) + np.uint64(number + 1))
            at, own = station[dofs - low], name[dofs - low]
            apart = (at - at.min(axis=1, keepdims=True)).astype(np.uint64)
            element = of_kind[kind]
            for column in range(at.shape[1]):
                element = _mixed(element + own[:, column] + (apart[:, column] << np.uint64(16)))
            for column in range(at.shape[1]):
                np.add.at(self.marks, at[:, column], _mixed(element + np.uint64(column)))

    def fingerprints(self, first: np.ndarray, last: np.ndarray) -> np.ndarray:
        """A number (k,) uint64 for each stretch from station ``first`` (k,) to before ``last``
        (k,), the same for stretches of the same marks."""
        sums, inverse = self._sums
        first, last = first - self.first, last - self.first
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


def _elements_between(block: Block, low: int, high: int) -> tuple[np.ndarray, ...]:
    """Unknowns (k, m) of the elements that have all of theirs from ``low`` to before ``high``, the
    kind (k,) of each, and a row with all numbers of each kind: which terms these are follows from
    the block."""
    terms = [term for term in (block.mass, block.stiffness, block.damping) if term is not None]
    near = block.near(low, high)
    dofs, kind = block.dofs[near].astype(np.int64), block.kind[near]
    inside = (dofs >= low).all(axis=1) & (dofs < high).all(axis=1)
    if not inside.all():
        dofs, kind = dofs[inside], kind[inside]
    if len(dofs) < len(block.dofs):
        used, kind = np.unique(kind, return_inverse=True)
        terms = [term[used] for term in terms]
    rows = [term.reshape(len(term), math.prod(term.shape[1:])) for term in terms]
    return dofs, kind, np.hstack(rows)


def _mixed(numbers: np.ndarray) -> np.ndarray:
    """The finaliser of SplitMix64: numbers that tell nothing of what they follow from."""
    numbers = (numbers ^ (numbers >> np.uint64(30))) * _FIRST
    numbers = (numbers ^ (numbers >> np.uint64(27))) * _SECOND
    return np.asarray(numbers ^ (numbers >> np.uint64(31)))
