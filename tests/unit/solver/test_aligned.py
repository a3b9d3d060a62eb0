"""Where arrays begin."""

from __future__ import annotations

import numpy as np
import pytest

from catenary.solver.kernels import aligned_arrays


@pytest.mark.parametrize("size", [0, 1, 7, 5000, 200_000])
def test_arrays_begin_at_a_cache_line_each_at_its_place_of_a_page(size: int) -> None:
    arrays = [aligned_arrays.zeros(size, place) for place in range(7)]
    assert all(array.size == size and not array.any() for array in arrays)
    if size:
        begins = [array.ctypes.data % aligned_arrays.PAGE for array in arrays]
        assert all(begin % aligned_arrays.LINE == 0 for begin in begins)
        # Some lines that one array is ahead of another do not bring them together.
        assert np.diff(sorted(begins)).min() > 8 * aligned_arrays.LINE


def test_a_copy_holds_the_same_in_one_dimension() -> None:
    numbers = np.arange(12.0).reshape(3, 4)[:, ::2]
    assert np.array_equal(aligned_arrays.copy(numbers), numbers.ravel())
