"""Reading by blocks and thinning for pictures: the same numbers, in bounded memory."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from scipy import signal

import catenary
from catenary.cases.ambrosio2012 import passages
from catenary.postproc.evaluate import filters
from catenary.postproc.evaluate.statistics import slack_times
from catenary.postproc.files import hdf5
from catenary.postproc.files.committed_rows import store_extremes
from catenary.postproc.files.header import LineRecord
from catenary.postproc.files.run_schema import COMPLETE
from catenary.postproc.read import validation
from catenary.postproc.read.results import Results, in_stretch
from catenary.postproc.report.pictures import figures


@pytest.mark.parametrize("shape", [(1,), (2,), (300,), (150_000,), (70_000, 2)])
@pytest.mark.parametrize("band", [(filters.low_pass, 20.0), (filters.band_5_20, 5.0)])
def test_filters_are_those_of_scipy(shape: tuple[int, ...], band: tuple[Any, float]) -> None:
    apply, slowest = band
    values = 140.0 + np.random.default_rng(3).normal(size=shape)
    kind: Any = ("low", 20.0) if apply is filters.low_pass else ("bandpass", (5.0, 20.0))
    sos = signal.butter(filters.ORDER, kind[1], btype=kind[0], fs=1e3, output="sos")
    padding = min(shape[0] - 1, int(np.ceil(6.0 / (slowest * 1e-3))))
    expected = signal.sosfiltfilt(sos, values, axis=0, padlen=padding)
    # Round-off, which poles near the unit circle magnify: (1 / (pi 5 Hz 1 ms))^2 = 4000 times.
    np.testing.assert_allclose(apply(values, 1e-3), expected, rtol=0.0, atol=1e-9)


def test_columns_and_extremes_are_those_of_the_whole_table(
    run_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(hdf5, "BLOCK_BYTES", 1e5)
    monkeypatch.setattr(hdf5, "_SLICE", 1000)
    with Results(run_folder) as results:
        for name in ("contact_force", "contact_position", "arm_uplift", "dropper_force"):
            whole = results.channel(name)
            low, high = results.extremes(name)
            np.testing.assert_array_equal(low, whole.min(axis=0))
            np.testing.assert_array_equal(high, whole.max(axis=0))
            blocks = list(results.blocks(name))
            assert len(blocks) > 1
            np.testing.assert_array_equal(np.concatenate([rows for _, rows in blocks]), whole)
            part = slice(1234, 5678)
            np.testing.assert_array_equal(results.column(name, 1, part), whole[part, 1])


@pytest.mark.parametrize(
    "record", [LineRecord(), LineRecord(every=5, window=(150.0, 60.0))], ids=["whole", "thinned"]
)
def test_slack_droppers_are_those_of_whole_tables(
    tmp_path: Path, march: Any, record_run: Any, monkeypatch: pytest.MonkeyPatch, record: LineRecord
) -> None:
    """Before the last pantograph and in or after its passage, read in many blocks."""
    monkeypatch.setattr(hdf5, "BLOCK_BYTES", 1e5)
    monkeypatch.setattr(hdf5, "COLUMNS_AT_ONCE", 7)
    record_run(tmp_path / "run.h5", march, record=record)
    with Results(tmp_path) as results:
        found, x = passages.slack_droppers(results)["all"], results.line("dropper_x")
        slack = results.channel("dropper_force") <= 0.0
        last = results.channel("contact_position").min(axis=1)[:: record.every]
        inside = in_stretch(x, *results.evaluation)
    after = last[:, None] >= x - passages.AHEAD
    before, behind = ((slack & own).any(axis=0) & inside for own in (~after, after))
    assert found == {
        "leading": before.sum(), "trailing": behind.sum(), "any": (before | behind).sum(),
        "of": inside.sum(),
    }  # fmt: skip
    assert 0 < found["leading"] and 0 < found["trailing"]


def test_a_thinned_curve_keeps_every_peak() -> None:
    y = np.random.default_rng(5).normal(size=1_000_003)
    y[[17, 500_000, 1_000_002]] = 50.0, -60.0, 70.0
    y[200_000:300_000] = np.nan
    chosen = figures.thinned(y)
    assert isinstance(chosen, np.ndarray) and chosen.size < 12_000
    assert {0, 17, 500_000, 1_000_002} <= set(chosen.tolist())
    assert (np.diff(chosen) > 0).all()
    # Each two hundredth of the picture shows the range that it has.
    for place in np.array_split(np.arange(y.size), 200):
        shown = y[chosen[(chosen >= place[0]) & (chosen <= place[-1])]]
        inner = place[1000:-1000]
        if np.isnan(y[inner]).any():
            continue
        assert np.nanmax(shown) >= np.nanmax(y[inner])
        assert np.nanmin(shown) <= np.nanmin(y[inner])
    assert figures.thinned(y[:100]) == slice(None)


REPORT = """
import sys
from pathlib import Path
from catenary.postproc.report.report import write_report
write_report(sys.argv[1], sys.argv[2])
print(Path("/proc/self/status").read_text().split("VmHWM:", 1)[1].split()[0])
"""
N_LONG = 600_000


def make_long(path: Path, make_march: Any, record_run: Any) -> None:
    """A run of 600 000 steps on a line of 144 droppers and 15 arms: 0.8 GB if all were there.

    Its line channels are stored where the first steps were; all else of them is a hole.
    """
    march = make_march(n_steps=N_LONG, dt=8.0 / N_LONG, separations=(0.0,))
    recorder_options = {"flush_every": 4096}
    from catenary.postproc.record.recorder import Recorder

    recorder = Recorder(march.comm, path, march.header(), **recorder_options)
    march.drive(recorder, last=20)
    recorder.close({})
    rows = N_LONG + 1
    time = march.dt * np.arange(rows)
    force = 150.0 + 30.0 * np.sin(10.0 * time) + 15.0 * np.sin(56.0 * time)
    made = {
        "contact_position": march.start + 83.333 * time,
        "contact_force": force,
        "head_height": 5.3 + 1e-4 * force,
        "wire_height": 5.3 + 1e-4 * force,
    }
    with h5py.File(path, "r+") as file:
        for name, values in made.items():
            file[f"channels/{name}"].resize(rows, axis=0)
            file[f"channels/{name}"][:, 0] = values
        for clock in ("time", "line_channels/time"):
            file[clock].resize(rows, axis=0)
            file[clock][:] = time
        for name in ("arm_uplift", "dropper_force"):
            file[f"line_channels/{name}"].resize(rows, axis=0)
        kept = {name: file[f"extremes/0/{name}"][...] for name in ("arm_uplift", "dropper_force")}
        for _ in range(2):
            store_extremes(file, rows, kept)
        file[COMPLETE][...] = [rows, 0, rows]


@pytest.mark.study
@pytest.mark.process
def test_a_report_on_a_long_run_takes_bounded_memory(
    tmp_path: Path, make_march: Any, record_run: Any
) -> None:
    path = tmp_path / "run.h5"
    make_long(path, make_march, record_run)
    done = subprocess.run(
        [sys.executable, "-c", REPORT, str(path), str(tmp_path)],
        capture_output=True,
        text=True,
        check=True,
    )
    # Of the address space: getrusage counts what the process that forked this one had, too.
    resident = int(done.stdout.split()[-1]) * 1024
    print(f"resident {resident / 1e6:.0f} MB")
    assert resident < 400e6
    assert (tmp_path / "report.html").stat().st_size > 100_000


class Read:
    """A table that counts the values that are read from it."""

    def __init__(self, table: h5py.Dataset) -> None:
        self._table, self.n_values = table, 0

    def __getattr__(self, name: str) -> Any:
        return getattr(self._table, name)

    def __getitem__(self, part: Any) -> np.ndarray:
        values: np.ndarray = self._table[part]
        self.n_values += values.size
        return values


@pytest.mark.parametrize("compression", [None, "gzip"])
def test_what_a_window_left_unwritten_is_not_read(compression: str | None, tmp_path: Path) -> None:
    """A band of columns moves along a table, whose other chunks are not in the file."""
    n_rows, n_columns, band = 2000, 4000, 40
    with h5py.File(tmp_path / "run.h5", "w") as file:
        table = file.create_dataset(
            "dropper_force", (n_rows, n_columns), "f8", chunks=(100, 64), compression=compression,
            fillvalue=np.nan,
        )  # fmt: skip
        for row in range(n_rows):
            table[row, row : row + band] = float(row)
        counted = Read(table)
        assert validation.valid_rows(counted, n_rows, 1e6, True) == n_rows
        # Blocks of a few hundred columns that meet the band, of a table that takes 64 MB.
        assert 0 < counted.n_values < 0.6 * n_rows * n_columns
        assert validation.valid_rows(table, n_rows, 1e6, False) == 0, "NaN where none may be"
        table[1500, 3900] = 1e7
        assert validation.valid_rows(table, n_rows, 1e6, True) == 1500


def test_written_blocks_hold_all_that_a_window_wrote(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """They are the whole table but for blocks that are NaN."""
    monkeypatch.setattr(hdf5, "COLUMNS_AT_ONCE", 64)
    monkeypatch.setattr(hdf5, "BLOCK_BYTES", 5e5)
    folder = tmp_path / "run"
    catenary.run(
        catenary.load("ambrosio2012").replace(
            line={"n_spans": 40}, window={"mode": "bounded"},
            train={"start_m": 300.0, "end_m": 1700.0}, evaluation={"from_m": 700.0, "to_m": 1400.0},
        ),
        folder,
        report=False,
    )  # fmt: skip
    with Results(folder) as results:
        whole = results.channel("dropper_force")
        found, n_values = np.full(whole.shape, np.nan), 0
        for part, columns, values in results.written_blocks("dropper_force"):
            found[part, columns] = values
            n_values += values.size
        np.testing.assert_array_equal(found, whole)
        slack = np.count_nonzero(whole <= 0.0, axis=0) * results.dt
        np.testing.assert_allclose(slack_times(results), slack, rtol=1e-12)
    assert n_values < 0.8 * whole.size
