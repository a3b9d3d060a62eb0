"""Motions of the line in several tangents side by side, and the changes of matrices that load them.

The numbers of an unknown in all tangents stand in lanes. Derivatives of the line's matrices by
several parameters are in the form that kernels multiply.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

from catenary.solver.integrators.line_integrator import LineIntegrator
from catenary.solver.integrators.line_state import PredictedLineState
from catenary.solver.kernels import aligned_arrays, native
from catenary.solver.model.alike import kinds_of, rounded
from catenary.solver.tangents.set_up import Change

# Numbers of matrices are kept to so many bits, far more than differences of set-ups know: rows of
# equal elements are equal then.
_BITS = 40
# Pairs of rows in a part of the line, whose stations a range that moves takes together.
_PART = 192
# Entries of a node of a wire: pairs beside its own, and their unknowns.
_BESIDE, _UNKNOWN = np.array([0, 0, 1, 1, 2, 2]), np.array([0, 1, 0, 1, 0, 1])
_NO_NUMBERS = np.zeros(0, dtype=np.int64)


def groups_of(line: LineIntegrator, changes: Sequence[Change]) -> list[list[int]]:
    """Groups of changes, by number, whose motions are stepped side by side.

    One group takes as many as kernels step at once. If there are more, changes that load the line
    have groups apart from the others, sorted by the rows that they load: a group computes a product
    for all its members if one needs it. Without kernels for several scenes each change is a group.
    """
    most = _sizes(line)[-1]
    if len(changes) <= most:
        return [list(range(len(changes)))] if changes else []
    rows = {
        k: {int(row) for term in change.matrices for row in term.rows}
        for k, change in enumerate(changes)
        if change.loads_line
    }
    without = [k for k in range(len(changes)) if k not in rows]
    # From the change with most rows on, each is followed by the one with the most similar rows.
    loaded, latest = [], set().union(*rows.values())
    while rows:
        loaded.append(min(rows, key=lambda k: len(rows[k] ^ latest)))
        latest = rows.pop(loaded[-1])
    return [
        part[first : first + most]
        for part in (without, loaded)
        for first in range(0, len(part), most)
    ]


def lanes_of(
    line: LineIntegrator, groups: Sequence[Sequence[Change]], starts: Sequence[Sequence[np.ndarray]]
) -> list[native.TangentLanes]:
    """Motions of groups of tangents at their start. One rank, Newmark's method in two passes.

    Parameters
    ----------
    line : LineIntegrator
        Line of a march.
    groups : sequence of sequence of Change
        Changes of set-ups by the parameters of each group.
    starts : sequence of sequence of array (n_local,)
        Derivatives of the line's acceleration at the start [m/s2 per unit] of each of these.
    """
    n = line.acceleration.size
    widths = _sizes(line)
    sizes = [next(size for size in widths if size >= len(group)) for group in groups]
    assert line.passes is not None
    shares = line.passes.parts.arrays.motion.shares
    return [
        _lanes(
            line,
            own,
            size,
            any(change.loads_line for change in group),
            changed_rows(group, size, n, shares),
        )
        for group, own, size in zip(groups, starts, sizes, strict=True)
    ]


def _sizes(line: LineIntegrator) -> list[int]:
    """Numbers of motions that kernels step at once, ascending."""
    assert line.passes is not None
    return [1, *line.passes.scenes_at_once]


def _lanes(
    line: LineIntegrator,
    starts: Sequence[np.ndarray],
    n_lanes: int,
    is_loaded: bool,
    rows: native.ChangedRows,
) -> native.TangentLanes:
    """Motions that start with these accelerations."""
    passes, state = line.passes, line.motion
    assert passes is not None and isinstance(state, PredictedLineState)
    arrays = passes.arrays_in_lanes(n_lanes, is_loaded)
    for lane, start in enumerate(starts):
        still = np.zeros_like(start)
        ahead = state.ahead(still, still, start)
        for numbers, values in zip(arrays.motion[:3], ahead, strict=True):
            numbers[lane::n_lanes] = values
    parts = passes.parts._replace(arrays=arrays)
    # Loads in time move the line everywhere, and at once.
    waits = not passes.parts.arrays.loads.size and not any(start.any() for start in starts)
    guard = line.windows.n_stations if waits else 0
    stepped = native.LanePasses(parts, guard)
    return native.TangentLanes(stepped, arrays.motion, arrays.loads, rows)


@dataclass(frozen=True)
class _Pairs:
    """Pairs of rows in each term, all terms of a pair one after the other.

    Attributes
    ----------
    n_terms : of a pair
    kinds : (n,) of those that have the same entries
    begin, counts : (n_kinds,) the first entry of a kind, and how many it has
    ahead : (m,) how many unknowns behind the pair's first one an entry stands
    entries : (m, 2, n_lanes) of the one row and of the other
    """

    n_terms: int
    kinds: np.ndarray
    begin: np.ndarray
    counts: np.ndarray
    ahead: np.ndarray
    entries: np.ndarray

    @property
    def pair(self) -> np.ndarray:
        """The pair of each."""
        return np.arange(self.kinds.size) // self.n_terms

    @property
    def term(self) -> np.ndarray:
        """The term of each."""
        return np.arange(self.kinds.size) % self.n_terms

    def of(self, kinds: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The entries of some kinds, one kind after the other, and which of these each is of."""
        which = np.repeat(np.arange(kinds.size), self.counts[kinds])
        ahead = np.arange(which.size) - np.searchsorted(which, which)
        return self.begin[kinds][which] + ahead, which


@dataclass(frozen=True)
class _Nodes:
    """Nodes of wires among pairs of rows in each term.

    Attributes
    ----------
    kind : (n,) of the node that a pair is, but for further entries; -1 of no node
    before, after : (n,) the pairs of the nodes beside it, or the pair itself
    entries : (n_kinds, 6, 2, n_lanes) at both unknowns of the pair before, of its own and of the
        pair after
    n_even : of the kinds that are between equal elements, the first ones
    """

    kind: np.ndarray
    before: np.ndarray
    after: np.ndarray
    entries: np.ndarray
    n_even: int

    @property
    def numbers(self) -> np.ndarray:
        """Numbers (n, n_lanes) of all kinds, see `native.ChangedRows`."""
        even, uneven = np.split(-self.entries, [self.n_even])
        six = np.stack([even[:, at, row] for row in (0, 1) for at in (2 + row, 4, 5)], axis=1)
        n_lanes = self.entries.shape[-1]
        return np.concatenate(
            [six.reshape(-1, n_lanes), uneven.transpose(0, 2, 1, 3).reshape(-1, n_lanes)]
        )

    def first_number(self, kind: np.ndarray) -> np.ndarray:
        """Where the numbers of a kind (n,) begin, -1 of no node."""
        return np.where(kind < 0, -1, 6 * kind + 6 * np.maximum(kind - self.n_even, 0))


def changed_rows(
    changes: Sequence[Change], n_lanes: int, n: int, shares: np.ndarray
) -> native.ChangedRows:
    """Changes of matrices over all lanes.

    Parameters
    ----------
    changes : sequence of Change
        Changes of set-ups, each in a lane of its own; further lanes have none.
    n_lanes : int
        Number of lanes.
    n : int
        Number of the line's unknowns.
    shares : array (5,)
        Shares of the march's motion, see `Motion` of the kernels.
    """
    weights, pairs = _entries(changes, n_lanes, n, shares)
    nodes = _nodes(pairs, n // 2)
    runs = _runs(pairs, nodes)
    rows, begin, ahead, further = _further(pairs, nodes, weights)
    parts = np.arange((n - 1) // (2 * _PART) + 2)
    starts = runs[:, 1] // _PART, rows[:, 0] // (2 * _PART)
    return native.ChangedRows(
        weights.reshape(-1, 3 * n_lanes),
        np.stack([np.searchsorted(start, parts) for start in starts], axis=1),
        runs,
        aligned_arrays.copy(nodes.numbers).reshape(-1, n_lanes),
        rows,
        begin,
        ahead,
        aligned_arrays.copy(further).reshape(-1, 3 * n_lanes),
        _PART,
    )


def _entries(
    changes: Sequence[Change], n_lanes: int, n: int, shares: np.ndarray
) -> tuple[np.ndarray, _Pairs]:
    """Weights (n_terms, 3, n_lanes) of x, y and z in the sums of each term, and all entries.

    The largest matrix of each lane is multiplied with the first sums, its next with the second
    ones.
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
        values.append(rounded(term.values, _BITS))
    row = np.concatenate(rows)
    # Each entry of a pair of rows once for all lanes, by pairs, terms and columns, which are near.
    ahead = np.concatenate(columns) - row // 2 * 2
    reach = int(np.abs(ahead).max(initial=0))
    mark = (row // 2 * n_terms + np.concatenate(numbers)) * (2 * reach + 1) + ahead + reach
    is_entry = np.zeros((n + 1) // 2 * n_terms * (2 * reach + 1), dtype=bool)
    is_entry[mark] = True
    own, ahead = np.divmod(np.flatnonzero(is_entry), 2 * reach + 1)
    entries = np.zeros((own.size, 2, n_lanes))
    entry = np.cumsum(is_entry)[mark] - 1
    entries[entry, row % 2, np.concatenate(lanes)] = np.concatenate(values)
    return weights, _kinds(n_terms, own, ahead - reach, entries, (n + 1) // 2)


def _kinds(
    n_terms: int, own: np.ndarray, ahead: np.ndarray, entries: np.ndarray, n_pairs: int
) -> _Pairs:
    """Find equal pairs; ``own`` (m,), ascending, are the numbers of those that have the entries."""
    begin = np.searchsorted(own, np.arange(n_pairs * n_terms + 1))
    counts = np.diff(begin)
    marks = np.full((counts.size, counts.max(initial=0)), -1.0)
    alike = kinds_of(np.c_[ahead, entries[:, 0], entries[:, 1]])[1]
    marks[own, np.arange(own.size) - begin[own]] = alike
    first, kinds = kinds_of(marks)
    return _Pairs(n_terms, kinds, begin[first], counts[first], ahead, entries)


def _nodes(pairs: _Pairs, n_whole: int) -> _Nodes:
    """Nodes of wires, of ``n_whole`` pairs with two rows."""
    pair, n_terms = pairs.pair, pairs.n_terms
    # Kinds with the entries of a beam that are even about the node.
    six = np.flatnonzero(pairs.counts == _BESIDE.size)
    own = pairs.begin[six, None] + np.arange(_BESIDE.size)
    ahead = pairs.ahead[own]
    beside = ahead[:, ::2] // 2
    is_wire = ahead == 2 * beside[:, _BESIDE] + _UNKNOWN
    is_wire &= (beside[:, 1] == 0)[:, None]
    # Deflections load a deflection evenly and a rotation oddly, rotations the other way about.
    even = np.where(_UNKNOWN[:, None] == [0, 1], 1.0, -1.0)[..., None]
    entries = pairs.entries[own]
    is_even = (entries == entries[:, [4, 5, 2, 3, 0, 1]] * even).all(axis=(2, 3))
    is_node = (is_wire & is_even).all(axis=1)
    first, alike = kinds_of(entries[is_node].reshape(-1, math.prod(entries.shape[1:])))
    of_kinds = np.full((pairs.begin.size, 3), [-1, 0, 0])
    of_kinds[six[is_node]] = np.c_[alike, beside[is_node][:, [0, 2]]]
    kind, before, after = of_kinds[pairs.kinds].T
    before, after = pair + before, pair + after

    # Other pairs whose outermost entries are at such a node before and at a pair after.
    others = np.flatnonzero((kind < 0) & (pairs.counts[pairs.kinds] > 0))
    at, which = pairs.of(pairs.kinds[others])
    starts = np.searchsorted(which, np.arange(others.size))
    reach = pairs.ahead[at] // 2
    low, high = (pair[others] + ends.reduceat(reach, starts) for ends in (np.minimum, np.maximum))
    outer = low * n_terms + pairs.term[others]
    is_between = (kind[outer] >= 0) & (after[outer] == pair[others])
    is_between &= (high > pair[others]) & (high < n_whole)
    others, low, high = others[is_between], low[is_between], high[is_between]
    kind[others], before[others], after[others] = kind[outer[is_between]], low, high
    even, n_even = entries[is_node][first], first.size

    # Those of them that are between two different elements: deflections turn them.
    ends = np.stack([low, pair[others], high], axis=1) - pair[others, None]
    first, alike = kinds_of(np.c_[pairs.kinds[others], ends].astype(float))
    at, which = pairs.of(pairs.kinds[others[first]])
    unknowns = 2 * ends[first][:, _BESIDE] + _UNKNOWN
    entry, place = np.nonzero(pairs.ahead[at, None] == unknowns[which])
    uneven = np.zeros((first.size, *even.shape[1:]))
    uneven[which[entry], place] = pairs.entries[at[entry]]
    differs = uneven[:, 3, 0].any(axis=1)
    number = n_even + np.cumsum(differs) - 1
    kind[others[differs[alike]]] = number[alike[differs[alike]]]
    return _Nodes(kind, before, after, np.concatenate([even, uneven[differs]]), n_even)


def _runs(pairs: _Pairs, nodes: _Nodes) -> np.ndarray:
    """Runs, see `native.ChangedRows`; each is within a part of the line.

    The runs of a wire in a part follow each other.
    """
    kind, after = nodes.kind, nodes.after
    own, term, part = np.arange(kind.size), pairs.term, pairs.pair // _PART
    following = after * pairs.n_terms + term
    joins = (kind >= 0) & (kind[following] >= 0) & (nodes.before[following] == pairs.pair)
    joins &= part[following] == part
    graph = sparse.csr_matrix((joins[joins], (own[joins], following[joins])), (own.size, own.size))
    _, wire = csgraph.connected_components(graph, directed=False)
    order = np.lexsort((wire, term, part))
    # Every pair has the first term, if only zeros.
    order = order[(kind >= 0)[order] | (term == 0)[order]]
    step = np.diff(pairs.pair[order], prepend=0)
    last, goes_on = order[:-1], np.zeros(order.size, dtype=bool)
    goes_on[1:] = joins[last] & (following[last] == order[1:]) & (kind[last] == kind[order[1:]])
    goes_on[1:] &= kind[last] < nodes.n_even
    # Another distance to the next node is another run.
    goes_on[1:] &= ~goes_on[:-1] | (step[1:] == step[:-1])
    starts = np.flatnonzero(~goes_on)
    sizes = np.diff(starts, append=order.size)
    first, last = order[starts], order[starts + sizes - 1]
    step = np.where(sizes > 1, step[np.minimum(starts + 1, order.size - 1)], 0)
    ends = [nodes.before[first], pairs.pair[first], after[last]]
    numbers, is_even = nodes.first_number(kind[first]), kind[first] < nodes.n_even
    return np.stack([*ends, sizes, step, numbers, is_even, term[first]], axis=1)


def _further(
    pairs: _Pairs, nodes: _Nodes, weights: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Entries that rows have beside those of nodes, see `native.ChangedRows`."""
    n_terms = pairs.n_terms
    before, after = nodes.before - pairs.pair, nodes.after - pairs.pair
    marks = np.c_[pairs.kinds, nodes.kind, before, after].reshape(-1, 4 * n_terms)
    first, kind = kinds_of(marks.astype(float))
    # The first pair of each kind, in all terms.
    some = (n_terms * first[:, None] + np.arange(n_terms)).ravel()
    of_some, term = np.divmod(np.arange(some.size), n_terms)
    own, of_own = pairs.of(pairs.kinds[some])
    products = pairs.entries[own, :, None] * weights[term[of_own], None]
    # Nodes have these already.
    has_node = np.flatnonzero(nodes.kind[some] >= 0)
    beside = np.c_[before, 0 * before, after][some[has_node]]
    of_nodes = -nodes.entries[nodes.kind[some[has_node]]][..., None, :]
    of_nodes = of_nodes * weights[term[has_node], None, None]
    products = np.concatenate([products, of_nodes.reshape(-1, *products.shape[1:])])
    ahead = np.append(pairs.ahead[own], 2 * beside[:, _BESIDE] + _UNKNOWN)[:, None] - [0, 1]
    row = np.append(of_some[of_own], np.repeat(of_some[has_node], _BESIDE.size))
    row = 2 * row[:, None] + [0, 1]
    # Entries of a row at one unknown as one, by rows.
    reach = int(np.abs(ahead).max(initial=0))
    marks = (row * (2 * reach + 1) + ahead + reach).ravel()
    order = np.argsort(marks, kind="stable")
    marks, starts = np.unique(marks[order], return_index=True)
    sums = np.add.reduceat(products.reshape(-1, *products.shape[2:])[order], starts)
    stays = sums.any(axis=(1, 2))
    row, ahead = np.divmod(marks[stays], 2 * reach + 1)
    begin = np.searchsorted(row, np.arange(2 * first.size + 1))
    pair = np.arange(kind.size)
    rows = np.stack([2 * pair[:, None] + [0, 1], 2 * kind[:, None] + [0, 1]], axis=-1)
    rows = rows.reshape(-1, 2)
    return rows[np.diff(begin)[rows[:, 1]] > 0], begin, ahead - reach, sums[stays]
