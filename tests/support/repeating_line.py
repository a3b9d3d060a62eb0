"""A matrix like a line's: block tridiagonal, and the same from span to span."""

from __future__ import annotations

import numpy as np
from scipy import sparse


def line(
    n_stations: int, period: int = 7, size: int = 4, joined: bool = False
) -> sparse.bsr_matrix:
    """A positive definite block tridiagonal matrix that repeats but at its ends.

    Stations are joined by each wire for itself, unless wires are ``joined`` between them.
    """
    rng = np.random.default_rng(7)
    own = rng.standard_normal((period, size, size))
    own = own @ own.transpose(0, 2, 1) + 8.0 * size * np.eye(size)
    beside = rng.standard_normal((period, size, size))
    if size == 4 and not joined:
        beside *= np.kron(np.eye(2), np.ones((2, 2)))
    data, indices, indptr = [], [], [0]
    for i in range(n_stations):
        if i > 0:
            data.append(beside[(i - 1) % period].T)
            indices.append(i - 1)
        data.append(own[i % period])
        indices.append(i)
        if i + 1 < n_stations:
            data.append(beside[i % period])
            indices.append(i + 1)
        indptr.append(len(indices))
    shape = (size * n_stations, size * n_stations)
    return sparse.bsr_matrix((np.array(data), indices, indptr), shape=shape)
