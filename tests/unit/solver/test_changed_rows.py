"""Changes of matrices as runs of nodes and further entries, against products of the matrices."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse

from catenary.solver.kernels import native
from catenary.solver.tangents.lanes import changed_rows
from catenary.solver.tangents.set_up import Change, MatrixTerm

# Those of a motion of which z is no acceleration alone.
SHARES = np.array([1.0, -0.5, 0.25, 1.0, -2.0])


def beam(length: float, rng: np.random.Generator) -> np.ndarray:
    """A matrix (4, 4) of an element as of mass, tension and bending with random factors."""
    l1, l2 = length, length**2
    mass = np.array(
        [
            [156, 22 * l1, 54, -13 * l1],
            [22 * l1, 4 * l2, 13 * l1, -3 * l2],
            [54, 13 * l1, 156, -22 * l1],
            [-13 * l1, -3 * l2, -22 * l1, 4 * l2],
        ]
    )
    bent = np.array(
        [
            [12, 6 * l1, -12, 6 * l1],
            [6 * l1, 4 * l2, -6 * l1, 2 * l2],
            [-12, -6 * l1, 12, -6 * l1],
            [6 * l1, 2 * l2, -6 * l1, 4 * l2],
        ]
    )
    return rng.uniform() * mass + rng.uniform() * bent


def wire(nodes: np.ndarray, lengths: np.ndarray, n: int, seed: int) -> sparse.csr_matrix:
    """Matrix of a wire whose nodes have these first unknowns."""
    matrix = sparse.lil_matrix((n, n))
    for first, second, length in zip(nodes, nodes[1:], lengths, strict=False):
        dofs = np.array([first, first + 1, second, second + 1])
        matrix[np.ix_(dofs, dofs)] += beam(length, np.random.default_rng(seed))
    return matrix.tocsr()


def term(matrix: sparse.csr_matrix, weights: tuple[float, float, float]) -> MatrixTerm:
    """The matrix with the rows that have entries."""
    matrix.sort_indices()
    rows = np.flatnonzero(np.diff(matrix.indptr))
    begin = np.append(matrix.indptr[rows], matrix.nnz)
    return MatrixTerm(rows, begin, matrix.indices.astype(np.int64), matrix.data, weights)


def change(*matrices: MatrixTerm) -> Change:
    """A change of matrices alone."""
    none = np.zeros(0)
    return Change(matrices, none, none, none, [], none, none, none, none, 0.0)


def loads(rows: native.ChangedRows, x: np.ndarray, n_lanes: int) -> np.ndarray:
    """Minus the products (n, n_lanes) with a motion (3, n), as `ChangedRows` has them."""
    n = x.shape[1]
    result = np.full((n + n % 2, n_lanes), np.nan)
    weights = np.reshape(rows.weights, (-1, 3, n_lanes))
    numbers = np.reshape(rows.numbers, (-1, n_lanes))
    for before, first, after, size, step, begin, is_even, number in np.asarray(rows.runs):
        if begin < 0:
            result[2 * first : 2 * first + 2] = 0.0
            continue
        sums = np.einsum("cn,cl->nl", x, weights[number])
        nodes = [before, *(first + step * np.arange(size)), after]
        for p, q, s in zip(nodes, nodes[1:], nodes[2:], strict=False):
            (w0, r0), (w1, r1), (w2, r2) = (sums[2 * k : 2 * k + 2] for k in (p, q, s))
            if is_even:
                own, level, turned, own_turned, sloping, bent = numbers[begin : begin + 6]
                product = [
                    own * w1 + level * (w0 + w2) + turned * (r2 - r0),
                    own_turned * r1 + sloping * (w2 - w0) + bent * (r0 + r2),
                ]
            else:
                twelve = numbers[begin : begin + 12].reshape(2, 6, n_lanes)
                product = (twelve * [w0, r0, w1, r1, w2, r2]).sum(axis=1)
            at = slice(2 * q, 2 * q + 2)
            result[at] = product if number == 0 else result[at] + product
    further = np.reshape(rows.further, (-1, 3, n_lanes))
    for row, kind in np.asarray(rows.rows):
        for k in range(rows.begin[kind], rows.begin[kind + 1]):
            result[row] -= x[:, row + rows.ahead[k]] @ further[k]
    return result[:n]


@pytest.mark.parametrize("extra", [0, 1])
@pytest.mark.parametrize("seed", range(3))
def test_runs_and_further_entries_make_the_products(seed: int, extra: int) -> None:
    rng = np.random.default_rng(seed)
    # Two wires; at some places the nodes of a third one between them. Lengths change under way.
    has_third = np.repeat(rng.random(60) < 0.4, 5)
    widths = np.where(has_third, 6, 4)
    starts = np.append(0, np.cumsum(widths)[:-1])
    n = int(widths.sum()) + extra
    lengths = np.repeat(rng.choice([0.5, 0.8], 60), 5)
    third = starts[has_third] + 2
    wires = [
        (starts, lengths),
        (starts + widths - 2, lengths),
        (third, np.full(third.size, 0.5)),
    ]

    def joined(size: int) -> sparse.csr_matrix:
        """Joints between the wires, as droppers."""
        at = rng.choice(starts.size, size, replace=False)
        one, other = starts[at], starts[at] + widths[at] - 2
        rows, columns = np.r_[one, one, other, other], np.r_[one, other, one, other]
        k = rng.uniform(size=size)
        return sparse.csr_matrix((np.r_[k, -k, -k, k], (rows, columns)), (n, n))

    line = [wire(*own, n, seed + k) for k, own in enumerate(wires)]
    stretch, still = (1.0, 0.03, 0.0), (0.0, 0.02, 1.0)
    matrices = [
        [(line[0], stretch), (joined(40), still)],
        [(line[1] + joined(40), stretch)],
        [(line[0] + line[1] + line[2], (0.0, 1.0, 0.0))],
        [(line[2], stretch), (wire(*wires[2], n, seed + 7), still)],
        [],
    ]
    if extra:
        last = sparse.csr_matrix(([2.0], ([n - 1], [n - 1])), (n, n))
        matrices.append([(last, still)])
    n_lanes = 8
    rows = changed_rows(
        [change(*(term(sparse.csr_matrix(m), w) for m, w in own)) for own in matrices],
        n_lanes,
        n,
        SHARES,
    )
    # Nodes of all wires between equal elements are in runs, so that few rows have further entries.
    assert len(rows.rows) < 0.6 * n

    x = rng.standard_normal((3, n))
    d, v, a = SHARES[:3] @ x, SHARES[3:] @ x[1:], x[2]
    found = loads(rows, x, n_lanes)
    for lane, own in enumerate(matrices):
        wanted = -sum((m @ (w[0] * d + w[1] * v + w[2] * a) for m, w in own), np.zeros(n))
        # Numbers have 40 bits.
        assert np.abs(found[:, lane] - wanted).max() < 1e-11 * max(1.0, np.abs(wanted).max())
    assert not found[:, len(matrices) :].any()
    # Each part of the line has the runs of its pairs, in order.
    firsts = np.asarray(rows.runs)[:, 1] // rows.part
    for part, (begin, end) in enumerate(zip(rows.parts[:-1, 0], rows.parts[1:, 0], strict=True)):
        assert (firsts[begin:end] == part).all()
    assert rows.parts[-1].tolist() == [len(rows.runs), len(rows.rows)]
