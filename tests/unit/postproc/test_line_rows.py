"""Channels of a line of which a window moves: extremes and rows against those of all columns."""

from __future__ import annotations

import numpy as np
import pytest
from mpi4py import MPI

from catenary.postproc.files.header import LineRecord
from catenary.postproc.record.recorder import LineGather
from catenary.solver.time_loop.views.channels import TrainLayout
from catenary.solver.time_loop.views.observers import Stage
from catenary.solver.window.moving_columns import Columns, MovingColumns

N, SPEED, BLOCK = 40, 3.0, 7
X = np.arange(N) * 10.0


def stage(moving: MovingColumns) -> Stage:
    columns = np.arange(N)
    return Stage(
        TrainLayout((1,)),
        1.0,
        0.0,
        100,
        X,
        X,
        columns,
        columns,
        np.zeros((0, 3)),
        np.zeros(0),
        moving=moving,
    )


def blocks() -> list[tuple[np.ndarray, np.ndarray, tuple[int, int]]]:
    """Positions, rows and columns that move, of blocks of steps behind a first one."""
    random = np.random.default_rng(7)
    row, result, step = random.normal(size=N), [], 1
    for _ in range(12):
        begin = int(SPEED * step / 10.0) + 2
        rows = np.empty((BLOCK, N))
        for i in range(BLOCK):
            row[begin : begin + 12] = random.normal(size=12) * (1.0 + 0.05 * step)
            rows[i] = row
        result.append((50.0 + SPEED * np.arange(step, step + BLOCK), rows, (begin, begin + 12)))
        step += BLOCK
    return result


@pytest.mark.parametrize(
    "record",
    [
        LineRecord(),
        LineRecord(every=3, window=(30.0, 20.0)),
        LineRecord(window=(30.0, 20.0), stretch=(100.0, 250.0)),
        LineRecord(every=2, names=("dropper_force",)),
    ],
)
def test_what_rests_is_not_looked_at(record: LineRecord) -> None:
    moving = MovingColumns()
    gather = LineGather(MPI.COMM_SELF, stage(moving), record, 1000)
    # A station for each column, of which each follows.
    table = np.tile(np.arange(N + 1)[:, None], (1, 2))
    columns = Columns(np.array([0, N]), np.arange(N + 1), table, table)
    first = np.random.default_rng(7).normal(size=(1, N))
    names = "arm_uplift", "dropper_force"
    parts = {
        "contact_position": slice(0, 1),
        names[0]: slice(1, N + 1),
        names[1]: slice(N + 1, None),
    }
    gather.take(0, np.hstack([[[50.0]], first, first]), parts, all_move=True)
    position, rows, step = [np.array([50.0])], [first], 1
    for at, block, (begin, end) in blocks():
        moving.follow(columns, names, np.array([begin, end]))
        gather.take(step, np.hstack([at[:, None], block, block]), parts, all_move=False)
        position.append(at)
        rows.append(block)
        step += BLOCK
    found, all_rows, all_at = gather(), np.concatenate(rows), np.concatenate(position)
    np.testing.assert_array_equal(found.chosen, np.arange(0, step, record.every))
    for name in names:
        ends = np.array([all_rows.min(axis=0), all_rows.max(axis=0)])
        np.testing.assert_array_equal(found.extremes[name], ends)
    assert set(found.values) == set(record.names) & set(names)
    own = record.columns(X)
    for first_column, values in found.values.values():
        expected = all_rows[:: record.every][:, own]
        edges = record.within(all_at[:: record.every, None])
        inside = np.ones(expected.shape, dtype=bool)
        if edges is not None:
            inside = (X[own] >= edges[0][:, None]) & (X[own] <= edges[1][:, None])
            assert values.shape[1] < own.size or record.stretch is not None
        assert not inside[:, :first_column].any()
        assert not inside[:, first_column + values.shape[1] :].any()
        part = slice(first_column, first_column + values.shape[1])
        near = inside[:, part]
        np.testing.assert_array_equal(values[near], expected[:, part][near])
