"""Bands of a sum of M, K and C, whose unknowns stand in the order along the track."""

from __future__ import annotations

import numpy as np
from scipy import linalg

from catenary.base.errors import RunBroken
from catenary.solver.model.entries import iterate_entries
from catenary.solver.model.model import Model

# Unknowns whose bands are put together at once, some ninety spans of two wires: entries of a
# hundred elements take nearly as long as those of a thousand.
_AT_ONCE = 2**14


class OperatorBands:
    """Lower bands of A, as LAPACK takes them. Not collective.

    Those of a short line are put together once, for whoever reads them.

    Parameters
    ----------
    model : Model
    coefficients : of M, K and C in A
    """

    def __init__(self, model: Model, coefficients: tuple[float, float, float]) -> None:
        self._model, self._coefficients = model, coefficients
        self._first = self._last = 0
        self._numbers = np.zeros((1, 0))

    def between(self, first: int, last: int, further: int = 0) -> np.ndarray:
        """Bands (k, last - first) of A for the columns from ``first`` to before ``last``.

        Entry [i, j] is that of A in row ``first`` + j + i and column ``first`` + j. Entries of rows
        from ``last`` on are undefined. Columns to before ``further`` are read next.
        """
        if first < self._first or last > self._last:
            if self._model.n_dofs <= _AT_ONCE:
                self._put_together(0, self._model.n_dofs)
            else:
                self._put_together(first, max(last, min(first + _AT_ONCE, further)))
        numbers = self._numbers[:, first - self._first : last - self._first]
        bands = max(1, min(len(numbers), last - first))
        while bands > 1 and not numbers[bands - 1, : last - first + 1 - bands].any():
            bands -= 1
        return numbers[:bands]

    def solve(self, first: int, last: int, right: np.ndarray, further: int = 0) -> np.ndarray:
        """Answers (n, last - first) of the unknowns from ``first`` to before ``last``, alone, to
        forces ``right`` of the same shape, which are overwritten; ``further`` as in ``between``.

        Raises
        ------
        RunBroken
            If A is not positive definite there.
        """
        bands = self.between(first, last, further)
        try:
            answers = linalg.solveh_banded(
                bands, right.T, overwrite_b=True, lower=True, check_finite=False
            )
        except linalg.LinAlgError as error:
            raise RunBroken("the step operator cannot be factored: it is not positive") from error
        return np.asarray(answers.T)

    def _put_together(self, first: int, last: int) -> None:
        parts = list(iterate_entries(self._model, first, last, *self._coefficients))
        held = self._model.constrained_between(first, last)
        parts.append((held, held, np.ones(held.size)))
        rows, columns, values = (np.concatenate(part) for part in zip(*parts, strict=True))
        lower = (columns <= rows) & (columns >= first)
        rows, columns, values = rows[lower], columns[lower], values[lower]
        apart, n = rows - columns, last - first
        bands = int(apart.max(initial=0)) + 1
        flat = np.bincount(n * apart + columns - first, weights=values, minlength=n * bands)
        self._first, self._last = first, last
        self._numbers = np.asarray(flat, dtype=float).reshape(bands, n)
