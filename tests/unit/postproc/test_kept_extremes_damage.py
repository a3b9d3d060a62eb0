"""Extremes and checksums whose numbers have the shape of an array are damaged ones."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pytest

from catenary.postproc.files.committed_rows import ROWS, drop_extremes, extremes_at, store_extremes
from catenary.postproc.files.hdf5 import ARRAYS_SUM, seal_arrays, sum_is_kept

CHANNELS = ("arm_uplift", "dropper_force")


@pytest.fixture
def file(tmp_path: Path) -> h5py.File:
    with h5py.File(tmp_path / "a.h5", "w") as opened:
        yield opened


def extremes(value: float) -> dict[str, np.ndarray]:
    return {name: np.full((2, 3), value) for name in CHANNELS}


@pytest.mark.parametrize(
    "rows", [np.array([20]), np.array([20, 20]), np.array(20.0), np.array(b"20")]
)
def test_a_count_that_is_no_single_whole_number_counts_as_not_kept(
    file: h5py.File, rows: np.ndarray
) -> None:
    store_extremes(file, 10, extremes(1.0))
    store_extremes(file, 20, extremes(2.0))
    assert extremes_at(file, 20) is not None
    slot = file["extremes/1"]
    del slot[ROWS]
    slot[ROWS] = rows
    assert extremes_at(file, 20) is None
    kept = extremes_at(file, 10)
    assert kept is not None
    assert {name: values.max() for name, values in kept.items()} == dict.fromkeys(CHANNELS, 1.0)
    drop_extremes(file, 10)
    assert extremes_at(file, 10) is not None


def test_those_of_the_first_row_are_there_for_a_run_that_begins_again(file: h5py.File) -> None:
    # A run that broke before its state was renewed goes on from the start, before which no row is.
    store_extremes(file, 1, extremes(1.0))
    store_extremes(file, 20, extremes(2.0))
    drop_extremes(file, 0)
    kept = extremes_at(file, 0)
    assert kept is not None and kept["arm_uplift"].max() == 1.0


def test_a_checksum_of_another_shape_is_not_kept(file: h5py.File) -> None:
    group, arrays = file.create_group("some"), {"a": np.arange(3.0)}
    assert sum_is_kept(group, arrays) is None
    seal_arrays(group, arrays)
    assert sum_is_kept(group, arrays) is True
    assert sum_is_kept(group, {"a": np.arange(4.0)}) is False
    known = group.attrs[ARRAYS_SUM]
    for odd in (np.array([known]), np.array([known, known]), "text"):
        group.attrs[ARRAYS_SUM] = odd
        assert sum_is_kept(group, arrays) is False
