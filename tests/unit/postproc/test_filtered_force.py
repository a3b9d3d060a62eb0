"""The filtered contact force in a result file: what it is, and what becomes of it."""

from __future__ import annotations

import shutil
from dataclasses import asdict
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from scipy import signal

from catenary.postproc.evaluate import filters
from catenary.postproc.evaluate.error_indicators import indicate
from catenary.postproc.evaluate.statistics import evaluate
from catenary.postproc.files.committed_rows import FILTERED_FORCE, ForceFilter
from catenary.postproc.read.results import Results
from catenary.postproc.record.recorder import Recorder
from catenary.results import Run

FILTER = ForceFilter(filters.ABOUT, filters.low_pass)


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory, make_march: Any, record_run: Any) -> Path:
    """The folder of a run that is done."""
    folder: Path = tmp_path_factory.mktemp("filtered")
    record_run(folder / "run.h5", make_march(n_steps=2000), force_filter=lambda: FILTER)
    return folder


def test_the_file_holds_the_force_that_scipys_filter_gives(done: Path) -> None:
    with Results(done) as results:
        force, stored = results.channel("contact_force"), results.stored_filtered_force()
    assert stored is not None and stored[1]["cut_off_Hz"] == 20.0
    sos = signal.butter(6, 20.0, fs=1000.0, output="sos")
    expected = signal.sosfiltfilt(sos, force, axis=0, padlen=300)
    np.testing.assert_array_equal(stored[0], expected)
    with h5py.File(done / "run.h5", "r") as file:
        table = file[FILTERED_FORCE]
        assert [dim[0].name for dim in table.dims] == ["/time", "/pantograph"]
        assert table.fletcher32 and table.attrs["unit"] == b"N" and table.attrs["order"] == 6


def test_python_reads_it_and_makes_it_where_there_is_none(done: Path, run_folder: Path) -> None:
    with Run(Results(done)) as run:
        found = run.filtered_force
        assert found.dims == ("time", "pantograph") and found.attrs["filter"].startswith("low-pass")
        np.testing.assert_array_equal(found, filters.low_pass(run.force.values, 1e-3))
    with Run(Results(run_folder)) as run:  # a file as earlier versions wrote them
        assert run._results.stored_filtered_force() is None
        expected = filters.low_pass(run.force.values, 1e-3)
        np.testing.assert_array_equal(run.filtered_force, expected)
        assert run.filtered_force.attrs["cut_off_Hz"] == 20.0


def test_statistics_and_indicators_are_the_same_with_and_without_it(
    tmp_path: Path, make_march: Any, record_run: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole, path = tmp_path / "whole.h5", tmp_path / "run.h5"
    record_run(whole, make_march(), force_filter=lambda: FILTER)
    shutil.copyfile(whole, path)
    with h5py.File(path, "r+") as file:
        del file[FILTERED_FORCE]
    with Results(path) as without:
        expected = evaluate(without), indicate(without)
        force = filters.contact_force(without, 0)
    filtered, low_pass = [], filters.low_pass

    def counted(values: np.ndarray, dt: float, cut_off: float = filters.CUT_OFF) -> np.ndarray:
        filtered.append((cut_off, values))
        return low_pass(values, dt, cut_off)

    monkeypatch.setattr(filters, "low_pass", counted)
    with Results(whole) as results:
        found = evaluate(results), indicate(results)
        np.testing.assert_array_equal(filters.contact_force(results, 0), force)
        heights = [results.column("wire_height", p) for p in range(2)]
    # What the file has passes no filter: at 20 Hz heights of the contact point alone do.
    at_20_hz = [values for cut_off, values in filtered if cut_off == filters.CUT_OFF]
    np.testing.assert_array_equal(at_20_hz, heights)
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_equal(asdict(one), asdict(other))


def test_a_run_that_goes_on_has_none_of_its_earlier_end(
    done: Path, tmp_path: Path, make_march: Any
) -> None:
    path = tmp_path / "run.h5"
    shutil.copyfile(done / "run.h5", path)
    march = make_march(n_steps=2000)
    recorder = Recorder(march.comm, path, march.header(), resume=True, force_filter=lambda: FILTER)
    march.drive(recorder, outcome="interrupted", first_step=2000)
    recorder.close()
    with Results(path) as results:
        assert results.outcome == "interrupted" and results.stored_filtered_force() is None


def test_a_damaged_one_is_left_aside(done: Path, tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    shutil.copyfile(done / "run.h5", path)
    with h5py.File(path, "r") as file:
        chunk = file[FILTERED_FORCE].id.get_chunk_info(0)
    content = bytearray(path.read_bytes())
    content[chunk.byte_offset + 7] ^= 0xFF
    path.write_bytes(content)
    with Results(path) as results:
        assert results.stored_filtered_force() is None
        assert not results.damage  # what it was made of is there
