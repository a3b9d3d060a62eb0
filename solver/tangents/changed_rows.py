"""Derivatives of a line's matrices by several parameters, in the form that kernels multiply."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy import sparse

from catenary.solver.kernels import aligned_arrays, native
from catenary.solver.model.alike import kinds_of
from catenary.solver.tangents.set_up import Change

# Numbers of matrices are kept to so many bits, far more than differences of set-ups know: rows of
# equal elements are equal then.
_BITS = 40
# Pairs of rows in a part of the line, whose stations a range that moves takes together.
_PART = 64
# Entries of a node of a wire: places beside its own, in distances to the next node, and unknowns.
_BESIDE, _UNKNOWN = np.array([-1, -1, 0, 0, 1, 1]), np.array([0, 1, 0, 1, 0, 1])
_SIGNS = np.array([1.0, -1.0, -1.0])[:, None]
_NO_NUMBERS = np.zeros(0, dtype=np.int64)


def changed_rows(
    changes: Sequence[Change], n_lanes: int, n: int, shares: np.ndarray
) -> native.ChangedRows:
    """Changes of matrices over all lanes.

    The largest matrix of each lane is multiplied with the first sums, its next with the second
    ones. ``shares`` are those of the march's motion of ``n`` unknowns.
    """
    # Displacement, velocity and acceleration in terms of x, y and z.
    of_motion = np.array([shares[:3], [0.0, *shares[3:]], [0.0, 0.0, 1.0]])
    terms = [
        (lane, number, term)
        for lane, change in enumerate(changes)
        for number, term in enumerate(sorted(change.matrices, key=lambda term: -term.values.size))
    ]
    n_terms = 1 + max((number for _, number, _ in terms), default=0)
    weights = np.zeros((n_terms, 3, n_lanes))
    rows, columns, lanes, numbers, values = ([_NO_NUMBERS] for _ in range(5))
    for lane, number, term in terms:
        weights[number, :, lane] = term.weights @ of_motion
        rows.append(np.repeat(term.rows, np.diff(term.begin)))
        columns.append(term.columns)
        lanes.append(np.full(term.values.size, lane))
        numbers.append(np.full(term.values.size, number))
        values.append(_rounded(term.values))
    row = np.concatenate(rows)
    # Each entry of a pair of rows once for all lanes, by pairs, terms and columns.
    mark = (row // 2 * n_terms + np.concatenate(numbers)) * n + np.concatenate(columns)
    marks, entry = np.unique(mark, return_inverse=True)
    entries = np.zeros((marks.size, 2, n_lanes))
    entries[entry, row % 2, np.concatenate(lanes)] = np.concatenate(values)
    pair, column = np.divmod(marks, n)
    pair, number = np.divmod(pair, n_terms)
    places = np.c_[number, column - 2 * pair]
    n_pairs = (n + 1) // 2
    return _in_runs(weights, n_pairs, pair, places, entries.reshape(-1, 2 * n_lanes))


def _in_runs(
    weights: np.ndarray, n_pairs: int, pair: np.ndarray, places: np.ndarray, entries: np.ndarray
) -> native.ChangedRows:
    """Runs of equal pairs of rows along the wires, and what other pairs have on top.

    ``pair`` (n,) has each of the ``entries`` (n, 2 n_lanes), ascending; ``places`` (n, 2) are its
    term and how many unknowns behind the pair's first one it stands.
    """
    begin = np.searchsorted(pair, np.arange(n_pairs + 1))
    counts = np.diff(begin)
    begin, n_lanes = begin[:-1], weights.shape[2]
    of_pairs = np.full((n_pairs, counts.max(initial=0)), -1.0)
    of_pairs[pair, np.arange(pair.size) - begin[pair]] = kinds_of(np.c_[places, entries])[1]
    first, kinds = kinds_of(of_pairs)

    # Kinds of nodes between two equal elements, and how many pairs further the next node is.
    six = np.flatnonzero(counts[first] == _BESIDE.size)
    own = begin[first[six], None] + np.arange(_BESIDE.size)
    step = places[own[:, -1], 1] // 2
    along = 2 * step[:, None] * _BESIDE + _UNKNOWN
    one, other = np.moveaxis(entries[own].reshape(-1, _BESIDE.size, 2, n_lanes), 2, 0)
    is_even = (
        (one[:, [0, 1, 3]] == one[:, [4, 5, 3]] * _SIGNS)
        & (other[:, [0, 1, 2]] == other[:, [4, 5, 2]] * -_SIGNS)
    ).all(axis=(1, 2))
    is_node = ~places[own, 0].any(axis=1) & (places[own, 1] == along).all(axis=1) & is_even
    steps = np.zeros(first.size, dtype=np.int64)
    steps[six[is_node]] = step[is_node]

    # Other pairs between two nodes continue the run of the one before.
    of_run = np.where(steps[kinds] > 0, kinds, -1)
    others = np.flatnonzero((of_run < 0) & (counts > 0))
    before = others + places[begin[others], 1] // 2
    step = steps[kinds[before]]
    is_between = (step > 0) & (before + step == others) & (others + step < n_pairs)
    of_run[others[is_between]] = kinds[before[is_between]]
    used, run = np.unique(of_run, return_inverse=True)
    nodes = begin[first[used[used >= 0]], None] + np.arange(_BESIDE.size)
    numbers = np.zeros((used.size, _BESIDE.size, n_lanes))
    # Of the deflection by deflections and rotations, of the rotation by these.
    one, other = np.moveaxis(entries[nodes].reshape(-1, _BESIDE.size, 2, n_lanes), 2, 0)
    numbers[used >= 0] = -np.stack(
        [one[:, 2], one[:, 4], one[:, 5], other[:, 3], other[:, 4], other[:, 5]], axis=1
    )
    step = np.where(used < 0, 0, steps[used])[run]
    part = np.arange(n_pairs) // _PART
    wire = np.arange(n_pairs) % np.maximum(step, 1)
    order = np.lexsort((wire, run, part))
    same = np.c_[part, run, wire][order]
    is_next = (same[1:] == same[:-1]).all(axis=1) & (np.diff(order) == step[order[1:]])
    starts = np.flatnonzero(np.r_[True, ~is_next])

    # What these others have on top, by x, y and z in place of terms and sums.
    marks = np.c_[kinds[others], of_run[others]]
    some, kind = kinds_of(marks.astype(float))
    own, run_too = marks[some].T
    has_run = np.flatnonzero(run_too >= 0)
    at, of_kind = _all(begin[first[own]], counts[first[own]])
    under, of_kind_too = _all(begin[first[run_too[has_run]]], _BESIDE.size)
    which = np.concatenate([at, under])
    signed = entries[which].reshape(which.size, 2, 1, n_lanes)
    signed[at.size :] *= -1.0
    products = (signed * weights[places[which, 0], None]).reshape(-1, 3 * n_lanes)
    row = 2 * np.concatenate([of_kind, has_run[of_kind_too]])[:, None] + [0, 1]
    ahead = places[which, 1, None] - [0, 1]
    reach = np.abs(ahead).max(initial=0)
    unique, entry = np.unique(row * (2 * reach + 1) + ahead + reach, return_inverse=True)
    sums = sparse.csr_matrix(
        (np.ones(entry.size), (entry, np.arange(entry.size))), (unique.size, entry.size)
    )
    further = sums @ products
    stays = further.any(axis=1)
    row, ahead = np.divmod(unique[stays], 2 * reach + 1)
    begin_of_rows = np.searchsorted(row, np.arange(2 * some.size + 1))
    rows = np.c_[2 * others[:, None] + [0, 1]].ravel()
    kind_of_rows = (2 * kind[:, None] + [0, 1]).ravel()
    has_some = np.diff(begin_of_rows)[kind_of_rows] > 0
    parts = np.arange(part[-1] + 2)
    return native.ChangedRows(
        weights[0].ravel(),
        parts=np.c_[
            np.searchsorted(part[order[starts]], parts),
            np.searchsorted(part[rows[has_some] // 2], parts),
        ],
        runs=np.c_[
            order[starts], np.diff(starts, append=n_pairs), step[order[starts]], run[order[starts]]
        ],
        numbers=aligned_arrays.copy(numbers).reshape(-1, n_lanes),
        rows=np.c_[rows, kind_of_rows][has_some],
        begin=begin_of_rows,
        ahead=ahead - reach,
        further=aligned_arrays.copy(further[stays]).reshape(-1, 3 * n_lanes),
        part=_PART,
    )


def _all(begin: np.ndarray, counts: np.ndarray | int) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of so many entries from each beginning on, and the beginning of each."""
    which = np.repeat(np.arange(begin.size), counts)
    ahead = np.arange(which.size) - np.searchsorted(which, which)
    return begin[which] + ahead, which


def _rounded(values: np.ndarray) -> np.ndarray:
    """Numbers with ``_BITS`` bits."""
    mantissa, exponent = np.frexp(values)
    return np.ldexp(np.round(np.ldexp(mantissa, _BITS)), exponent - _BITS)
