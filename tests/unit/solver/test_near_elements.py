"""Elements of a block that are near a range of unknowns, whatever their order."""

from __future__ import annotations

import numpy as np
import pytest

from catenary.solver.model.model import Block

N = 101  # no multiple of what is looked for together


@pytest.mark.parametrize("ordered", [True, False])
def test_all_elements_of_a_range_are_among_those_near(ordered: bool) -> None:
    first = 2 * np.arange(N)
    dofs = first[:, None] + np.arange(4)
    if not ordered:
        dofs = dofs[np.random.default_rng(3).permutation(N)]
    block = Block("wire", dofs, np.arange(N), None, None)
    for low, high in ((0, 4), (60, 61), (100, 180), (200, 204), (0, 204)):
        found = np.arange(N)[block.near(low, high)]
        inside = np.flatnonzero(((dofs >= low) & (dofs < high)).any(axis=1))
        assert np.isin(inside, found).all()
        if ordered:  # and few others, in order
            assert (np.diff(found) == 1).all() and found.size <= inside.size + 32


def test_a_block_without_elements_has_none_near() -> None:
    block = Block("wire", np.zeros((0, 4), dtype=np.int64), np.zeros(0, int), None, None)
    assert np.arange(0)[block.near(0, 10)].size == 0
