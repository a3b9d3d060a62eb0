"""Growing tables cut where a run goes on, with a chunk at their end that is damaged."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from damaging import spoil_chunk

from catenary.postproc.files.hdf5 import FORMAT_BOUNDS, Damage, rows_before, shorten

N, COLUMNS, CHUNK = 1050, 9, (100, 5)
PACKED: dict[str, Any] = {"compression": "gzip", "shuffle": True}


def made(path: Path, **filters: Any) -> np.ndarray:
    """A file with a table of ``N`` rows and its clock; returns the table."""
    values = np.random.default_rng(5).normal(size=(N, COLUMNS))
    known: dict[str, Any] = {"fletcher32": True, "fillvalue": np.nan, **filters}
    with h5py.File(path, "w", libver=FORMAT_BOUNDS) as file:
        file.create_dataset("table", data=values, chunks=CHUNK, maxshape=(None, COLUMNS), **known)
        file.create_dataset("time", data=np.arange(N), chunks=(100,), maxshape=(None,), **known)
    return values


@pytest.mark.parametrize("filters", [{}, PACKED])
@pytest.mark.parametrize("rows", [1049, 1050, 2000])
def test_a_damaged_end_is_lost_and_nothing_else(
    filters: dict[str, Any], rows: int, tmp_path: Path
) -> None:
    path = tmp_path / "file.h5"
    values = made(path, **filters)
    spoil_chunk(path, "table", (1000, 5))
    kept = min(rows, N)
    with h5py.File(path, "r+", libver=FORMAT_BOUNDS) as file:
        assert shorten(file, "table", rows) == kept - 1000
        file["table"].resize(1200, axis=0)
        file["table"][kept:] = 7.0
    expected = np.vstack([values[:kept], np.full((1200 - kept, COLUMNS), 7.0)])
    expected[1000:kept, 5:] = np.nan
    with h5py.File(path) as file:
        np.testing.assert_array_equal(file["table"][...], expected)


@pytest.mark.parametrize("rows", [0, 500, 1000])
def test_a_damaged_chunk_behind_the_cut_goes_with_it(rows: int, tmp_path: Path) -> None:
    path = tmp_path / "file.h5"
    values = made(path)
    spoil_chunk(path, "table", (1000, 0))
    with h5py.File(path, "r+", libver=FORMAT_BOUNDS) as file:
        assert shorten(file, "table", rows) == 0
    with h5py.File(path) as file:
        np.testing.assert_array_equal(file["table"][...], values[:rows])


def test_times_are_counted_and_not_guessed(tmp_path: Path) -> None:
    path = tmp_path / "file.h5"
    made(path)
    spoil_chunk(path, "time", (1000,))
    with h5py.File(path) as file:
        assert rows_before(file["time"], 1000, 998.5) == 999
        assert rows_before(file["time"], 1000, 5000.0) == 1000
        with pytest.raises(Damage, match="time is damaged"):
            rows_before(file["time"], N, 998.5)
