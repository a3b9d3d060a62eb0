"""Types of bound arguments are those that Numba finds, also when they are taken from before."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pytest
from numba import typeof

from catenary.solver.base.kernels.bound import _type_of


class Pair(NamedTuple):
    """Two arrays."""

    first: np.ndarray
    second: np.ndarray


class Other(NamedTuple):
    """The same under other names."""

    left: np.ndarray
    right: np.ndarray


RECORDS = np.zeros(3, dtype=[("a", np.float64), ("b", np.int64, (2,))])
READ_ONLY = np.zeros(3)
READ_ONLY.flags.writeable = False
TABLE = np.zeros((3, 4))
ARGUMENTS: list[Any] = [
    np.zeros(3),
    np.zeros(3, dtype=np.int64),
    np.zeros(3, dtype=bool),
    READ_ONLY,
    TABLE,
    TABLE.T,
    TABLE[:, 1:3],
    RECORDS,
    RECORDS[["a"]],
    Pair(np.zeros(3), TABLE),
    Pair(np.zeros(3), TABLE.T),
    Other(np.zeros(3), TABLE),
    (Pair(np.zeros(3), np.zeros(3)), Other(np.zeros(0), RECORDS), 1.0),
    (np.zeros(3), 1),
    (np.zeros(3), True),
    (np.zeros(3), 2**63),
    1.0,
    1,
    True,
    np.float64(1.0),
]


@pytest.mark.parametrize("number", range(len(ARGUMENTS)))
def test_a_type_is_that_of_numba(number: int) -> None:
    for _ in range(2):  # the second time from memory, after all others
        assert _type_of(ARGUMENTS[number]) == typeof(ARGUMENTS[number])


def test_no_two_types_share_a_memory() -> None:
    found = [_type_of(argument) for argument in ARGUMENTS]
    assert found == [typeof(argument) for argument in ARGUMENTS]
