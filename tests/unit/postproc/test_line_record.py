"""What is recorded of the line's channels: windows, cadence, spans, names, compression."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from studies import few

from catenary.postproc.evaluate import statistics
from catenary.postproc.files.header import GZIP, LineRecord, record_words
from catenary.postproc.read.results import Results
from catenary.postproc.record.recorder import Recorder
from catenary.solver.time_loop.views.channels import TrainLayout, line_channels_of_all

N_STEPS, FLUSH = 3000, 400
# A train on a line without stops, whose wires do not move along the track.
USUAL = TrainLayout((1,))
WINDOW = (120.0, 80.0)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory, make_march: Any, record_run: Any) -> Path:
    path = tmp_path_factory.mktemp("whole") / "run.h5"
    return record_run(path, make_march(n_steps=N_STEPS), flush_every=FLUSH)


def expected(whole: Results, name: str, record: LineRecord) -> np.ndarray:
    """A channel as ``record`` has it, from the record of everything."""
    values = whole.channel(name)[:: record.every]
    x = whole.line("arm_x" if name == "arm_uplift" else "dropper_x")
    if name not in record.names:
        return np.full_like(values, np.nan)
    if record.window is not None:
        position = whole.channel("contact_position")[:: record.every]
        low = position.min(axis=1) - record.window[0]
        high = position.max(axis=1) + record.window[1]
        inside = (x >= low[:, None]) & (x <= high[:, None])
        values = np.where(inside, values, np.nan)
    if record.stretch is not None:
        values[:, (x < record.stretch[0]) | (x > record.stretch[1])] = np.nan
    return values


RECORDS = {
    "thinned": LineRecord(every=7),
    "window": LineRecord(window=WINDOW),
    "both": LineRecord(every=5, window=WINDOW, compression=GZIP),
    "stretch": LineRecord(stretch=(250.0, 400.0)),
    "all of them": LineRecord(every=3, window=WINDOW, stretch=(250.0, 400.0), compression=GZIP),
    "one channel": LineRecord(names=("arm_uplift",)),
    "no channel": LineRecord(names=()),
    "compressed": LineRecord(compression=GZIP),
}


@pytest.mark.parametrize("name", few(RECORDS, "all of them", "window", "thinned"))
def test_a_part_of_the_record_is_that_of_the_whole_one(
    tmp_path: Path, make_march: Any, record_run: Any, whole: Path, name: str
) -> None:
    record = RECORDS[name]
    path = record_run(
        tmp_path / "run.h5", make_march(n_steps=N_STEPS), flush_every=FLUSH, record=record
    )
    with Results(whole) as everything, Results(path) as part:
        assert part.line_record == record.of(USUAL)
        np.testing.assert_array_equal(part.line_time, everything.time[:: record.every])
        for channel in line_channels_of_all():
            values = expected(everything, channel, record)
            np.testing.assert_array_equal(part.channel(channel), values, channel)
            blocks = list(part.blocks(channel))
            np.testing.assert_array_equal(np.concatenate([b for _, b in blocks]), values)
            for column in (0, 3, values.shape[1] - 1):
                np.testing.assert_array_equal(part.column(channel, column), values[:, column])
            # Extremes are those of every step, whatever is recorded.
            every_step = everything.channel(channel)
            extremes = np.array([every_step.min(axis=0), every_step.max(axis=0)])
            np.testing.assert_array_equal(part.extremes(channel), extremes)
        first, second = statistics.evaluate(everything), statistics.evaluate(part)
        np.testing.assert_array_equal(first.supports.uplift, second.supports.uplift)
        np.testing.assert_array_equal(first.droppers.lowest, second.droppers.lowest)
        assert first.droppers.n_slackened == second.droppers.n_slackened > 0
    assert path.stat().st_size <= whole.stat().st_size


def test_a_window_takes_room_near_the_train_only(
    tmp_path: Path, make_march: Any, record_run: Any, whole: Path
) -> None:
    record = LineRecord(window=(0.0, 0.0))
    path = record_run(
        tmp_path / "run.h5", make_march(n_steps=N_STEPS), flush_every=FLUSH, record=record
    )
    with h5py.File(path) as part, h5py.File(whole) as everything:
        few, all_of_them = (
            file["line_channels/dropper_force"].id.get_num_chunks() for file in (part, everything)
        )
    # 144 droppers in three blocks; the train of 100 m moves from 60 m to 310 m of 800 m.
    assert all_of_them == 3 * 8
    assert few < 0.7 * all_of_them


@pytest.mark.parametrize(
    "name",
    [
        pytest.param("both", marks=pytest.mark.study),
        "all of them",
        pytest.param("stretch", marks=pytest.mark.study),
    ],
)
def test_a_restarted_run_has_the_same_content(
    tmp_path: Path, make_march: Any, record_run: Any, name: str
) -> None:
    march, record = make_march(n_steps=1500), RECORDS[name]
    known = {"flush_every": FLUSH, "energy_every": 50, "record": record}
    reference = record_run(tmp_path / "whole.h5", march, **known)
    path = tmp_path / "run.h5"
    # It breaks 150 steps after the last state, at step 799, and once more.
    for first, last in ((0, 949), (799, 1250), (1199, None)):
        part = Recorder(march.comm, path, march.header(), resume=first > 0, **known)
        march.drive(part, first_step=first, last=last, outcome="done" if last is None else "broken")
        part.close({})
    with Results(reference) as one, Results(path) as other:
        np.testing.assert_array_equal(one.line_time, other.line_time)
        for channel in line_channels_of_all():
            np.testing.assert_array_equal(one.channel(channel), other.channel(channel))
            np.testing.assert_array_equal(one.extremes(channel), other.extremes(channel))
        np.testing.assert_array_equal(one.energies()["time"], other.energies()["time"])


def test_extremes_of_a_broken_run_are_those_of_its_rows(tmp_path: Path, make_march: Any) -> None:
    """The last flush of a run that broke stores no state, but its rows count."""
    march, path = make_march(n_steps=1000), tmp_path / "run.h5"
    recorder = Recorder(march.comm, path, march.header(), flush_every=300)
    march.drive(recorder, last=450, outcome="no convergence at t = 0.451 s")
    recorder.close({})
    with Results(path) as results:
        assert results.n_steps == 450 and results.checkpoint["step"] == 299
        found = results.extremes("arm_uplift")
        np.testing.assert_array_equal(found[1], results.channel("arm_uplift").max(axis=0))


def test_a_record_is_told_in_words_and_kept_in_the_file() -> None:
    both = LineRecord(every=5, window=(300.0, 200.0), compression=GZIP, by_size=True)
    assert LineRecord.model_validate(both.model_dump(mode="json", by_alias=True)) == both
    assert record_words(both, 1e-3) == (
        "recorded every 5 ms within 300 m behind and 200 m ahead of the train; extremes are kept "
        "of every step; compressed (chosen by size)"
    )
    assert record_words(LineRecord(), 1e-3) == "recorded at every step"
    assert record_words(LineRecord(names=()), 1e-3).startswith("not recorded")


def test_a_closed_file_has_no_room_left_behind_its_end(whole: Path) -> None:
    """Room is claimed a flush ahead; a file that is closed gives it back."""
    with h5py.File(whole) as file:
        stored = 0

        def count(_: str, item: Any) -> None:
            nonlocal stored
            stored += item.id.get_storage_size() if isinstance(item, h5py.Dataset) else 0

        file.visititems(count)
    assert stored < whole.stat().st_size < stored + 150_000
