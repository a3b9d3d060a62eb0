"""A result file is read while its run goes on writing it."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest

from catenary.postproc.files.hdf5 import FORMAT_BOUNDS
from catenary.postproc.files.run_schema import COMPLETE, RUNNING
from catenary.postproc.read.result_tables import opened

ROWS = 200
# What the run does after the file has been opened: so many chunks that HDF5 divides their index.
GOES_ON = """
import sys, h5py, numpy as np
with h5py.File(sys.argv[1], "r+", libver=("v108", "v108"), locking=False) as file:
    file["time"].resize((20_000,))
    file["time"][:] = np.arange(20_000.0)
    file["complete_rows"][...] = 20_000
"""


def written(path: Path) -> Path:
    with h5py.File(path, "w", libver=FORMAT_BOUNDS) as file:
        file.attrs["outcome"] = RUNNING
        file.create_dataset("time", data=np.arange(float(ROWS)), maxshape=(None,), chunks=(8,))
        file[COMPLETE] = [ROWS, 0, 0]
    return path


def go_on(path: Path) -> None:
    subprocess.run([sys.executable, "-c", GOES_ON, str(path)], check=True, timeout=240)


@pytest.mark.process
def test_what_was_there_at_opening_is_read_after_the_run_has_gone_on(tmp_path: Path) -> None:
    path = written(tmp_path / "run.h5")
    with h5py.File(path, "r", locking=False) as file:
        go_on(path)
        with pytest.raises(OSError, match="overflow"):  # what this is for
            file["time"][:ROWS]
    path = written(tmp_path / "again.h5")
    file, complete = opened(path)
    go_on(path)
    with file:
        np.testing.assert_array_equal(file["time"][:ROWS], np.arange(float(ROWS)))
    assert complete is not None and complete[0][0] == ROWS


def test_a_file_that_is_damaged_for_good_is_opened_all_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = written(tmp_path / "run.h5")
    with h5py.File(path, "r+") as file:
        file[COMPLETE][...] = -1
    pauses: list[float] = []
    monkeypatch.setattr("time.sleep", pauses.append)
    file, complete = opened(path)
    assert complete is None and len(pauses) == 19
    file.close()
