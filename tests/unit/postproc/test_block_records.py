"""Rows that observers are shown many at once, against the same steps one by one."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from catenary.postproc.files.header import GZIP, LineRecord
from catenary.postproc.record.progress import Progress
from catenary.postproc.record.recorder import Recorder
from catenary.postproc.record.snapshots.fields import FieldRecorder
from catenary.solver.time_loop.ts_stepper import ObserverList
from catenary.solver.time_loop.views.observers import Observer


def drive_by_blocks(march: Any, *observers: Observer, first: int, most: int) -> list[int]:
    """As ``drive``, with as many steps at once as the observers need no states between.

    Returns the steps of each block.
    """
    stage, step, blocks, observer_list = (
        march.stage(first),
        first,
        [],
        ObserverList(observers, None),
    )
    observer_list.start(stage)
    observer_list.show(lambda: march.view(first))
    while step < march.n_steps:
        until = min(march.n_steps, step + most, observer_list.next_state(step))
        views = [march.view(number) for number in range(step + 1, until + 1)]
        rows = np.array([view.row for view in views])
        times = np.array([view.time for view in views])
        due = observer_list.next_motion(step)
        shown = [views[-1]]
        while due < until:
            shown.insert(-1, views[due - step - 1])
            due = observer_list.next_motion(due)
        observer_list.show_block(step, times, rows, shown)
        rows[:] = times[:] = np.nan  # they are overwritten
        blocks.append(len(views))
        step = until
    observer_list.finish("done")
    return blocks


def contents(path: Path) -> dict[str, bytes]:
    """Every dataset of a file, as bytes with its type and shape."""
    found: dict[str, bytes] = {}

    def take(name: str, place: Any) -> None:
        if isinstance(place, h5py.Dataset):
            found[name] = repr((place.dtype, place.shape, place.chunks)).encode()
            values = np.asarray(place[...])
            found[name] += repr(values).encode() if values.dtype == object else values.tobytes()

    with h5py.File(path) as file:
        file.visititems(take)
    return found


@pytest.mark.parametrize(
    ("flush_every", "energy_every", "record"),
    [
        (64, None, None),
        (50, 7, None),
        pytest.param(1, 3, None, marks=pytest.mark.study),
        (1000, 10, LineRecord(every=3)),
        (60, 25, LineRecord(every=4, window=(60.0, 40.0), compression=GZIP)),
        (77, None, LineRecord(stretch=(100.0, 300.0), names=("arm_uplift",))),
    ],
)
@pytest.mark.parametrize("first", [pytest.param(0, marks=pytest.mark.study), 31])
def test_a_file_written_by_blocks_is_the_same(
    tmp_path: Path,
    make_march: Any,
    flush_every: int,
    energy_every: int | None,
    record: LineRecord | None,
    first: int,
) -> None:
    march = make_march(n_steps=150)
    found = {}
    for way in ("steps", "blocks"):
        files, path = (tmp_path / way / name for name in ("fields.xdmf", "run.h5"))
        if first:
            # An earlier part, which is continued.
            begun = Recorder(
                march.comm, path, march.header(), flush_every=flush_every, record=record,
                energy_every=energy_every,
            )  # fmt: skip
            march.drive(begun, outcome="interrupted", last=first)
            begun.close()
        recorder = Recorder(
            march.comm, path, march.header(), flush_every=flush_every, record=record,
            energy_every=energy_every, resume=bool(first),
        )  # fmt: skip
        fields = FieldRecorder(march.comm, files, march.recorded, every=20, flush_every=flush_every)
        observers = fields, Progress(march.comm), recorder
        if way == "steps":
            march.drive(*observers, first_step=first)
        else:
            blocks = drive_by_blocks(march, *observers, first=first, most=40)
            assert max(blocks) == min(40, flush_every)
        recorder.close({"march_wall_s": 1.0})
        found[way] = contents(path), contents(files.with_suffix(".h5"))
    for one, other in zip(found["steps"], found["blocks"], strict=True):
        assert one.keys() == other.keys()
        assert [name for name in one if one[name] != other[name]] == []


def test_flushes_fall_on_the_same_steps(tmp_path: Path, make_march: Any) -> None:
    """What a killed run leaves does not depend on how its rows came."""
    march = make_march(n_steps=200)
    complete = []

    class Watched(Recorder):
        def _flush(self, view: Any) -> None:
            super()._flush(view)
            complete.append((None if view is None else view.step, self._last_time))

    for way in ("steps", "blocks"):
        recorder = Watched(march.comm, tmp_path / f"{way}.h5", march.header(), flush_every=64)
        if way == "steps":
            march.drive(recorder)
        else:
            drive_by_blocks(march, recorder, first=0, most=1000)
        recorder.close()
    half = len(complete) // 2
    assert complete[:half] == complete[half:]
    assert [step for step, _ in complete[:half]] == [0, 63, 127, 191, 200]
