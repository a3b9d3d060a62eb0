"""Sizes of the files of a run, from the shapes in which they are written.

What HDF5 and the report add beyond that was measured on runs of the shipped cases.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from catenary.cases.run.recording import (
    THINNED_WINDOW,
    Recording,
    shown_share,
    snapshot_bytes,
    train_of,
)
from catenary.cases.scene.problem import resolved
from catenary.postproc.channels.line_record import GZIP
from catenary.postproc.files.hdf5.chunk_shapes import Chunk, chunks_of
from catenary.solver.problem.problem import Problem
from catenary.solver.problem.watched_links import GAUGES
from catenary.solver.time_loop.views import channels
from catenary.solver.time_loop.views.channels import Channel

if TYPE_CHECKING:
    from catenary.cases.scene.scene import Scene

_BYTES = 8
# Checksum and entry in the index of a chunk [B].
_PER_CHUNK = 4 + 85
# Tables, groups and attributes of a result file without rows [B].
_EMPTY_FILE = 90e3
# Arrays of the line's motion in a state to continue from, each with a number for every unknown; a
# state is kept twice.
_STATE_ARRAYS = 5.5
# Numbers for every node and dropper in the tables of the line at rest.
_PER_NODE, _PER_DROPPER = 6, 7
# Rows at which the columns in a window are counted.
_SAMPLES = 10_000
# Bytes that gzip leaves of a number near the train, within ``THINNED_WINDOW``, and far from it.
_COMPRESSED = {"dropper_force": (0.7, 0.1), "arm_uplift": (0.95, 0.85)}
_INCOMPRESSIBLE = (1.0, 1.0)
# Report and pictures of any run, and what a dropper and an arm add to its tables [B].
_REPORT, _REPORT_PER_DROPPER, _REPORT_PER_ARM = 1.2e6, 300.0, 90.0
# Tables of the snapshots' blocks, and room that is claimed beside them [B].
_FIELD_TABLES = 90e3
# Lines of a block in the XDMF file at each snapshot, and of each of its fields [B].
_XDMF_BLOCK, _XDMF_FIELD = 600, 250


@dataclass(frozen=True)
class FileSizes:
    """Sizes of what a run leaves in its folder [B].

    Attributes
    ----------
    result : ``run.h5``
    film : ``fields.h5`` and ``fields.xdmf``
    report : ``report.html``, its pictures and tables
    """

    result: float
    film: float
    report: float

    @property
    def total(self) -> float:
        """All of them [B]."""
        return self.result + self.film + self.report


def estimate_files(
    scene: Scene, problem: Problem, recording: Recording, n_dofs: int, flush_every: int
) -> FileSizes:
    """Sizes of the files of a run. Not collective.

    Parameters
    ----------
    recording : of the run
    n_dofs : unknowns of the line
    flush_every : steps between two flushes
    """
    tables = _tables(problem, recording)
    shapes = chunks_of(tables, recording.n_steps, flush_every, recording.line.every)
    rows = sum(
        _table_bytes(path, columns, shapes[path], problem, recording)
        for path, (_, columns) in tables.items()
    )
    extent = recording.extent
    n_droppers, n_arms = extent.dropper_x.size, extent.arm_x.size
    n_ends = len(GAUGES) * recording.end_x.size
    kept = 2 * (_STATE_ARRAYS * n_dofs + 2 * (n_droppers + n_arms + n_ends))
    at_rest = _PER_NODE * extent.n_nodes + _PER_DROPPER * n_droppers
    filtered = _BYTES * len(problem.train.placements) * (recording.n_steps + 1)
    head = _EMPTY_FILE + len(json.dumps(resolved(scene)))
    film = 0.0
    if recording.field_every:
        n_snapshots = recording.n_steps // recording.field_every + 1
        film = _film_bytes(problem, recording, n_snapshots)
    return FileSizes(
        result=rows + _BYTES * (kept + at_rest) + filtered + head,
        film=film,
        report=_REPORT + _REPORT_PER_DROPPER * n_droppers + _REPORT_PER_ARM * n_arms,
    )


def _film_bytes(problem: Problem, recording: Recording, n_snapshots: int) -> float:
    """Size of ``fields.h5`` and ``.xdmf``, were all parts of the line in them [B]."""
    fields, line = recording.fields, problem.line
    share = shown_share(fields, problem, recording.n_steps)
    extent = recording.extent
    n_blocks = len(line.wires) + 3 + bool(line.clamps)
    n_points = extent.n_nodes + 2 * (extent.dropper_x.size + extent.arm_x.size)
    n_points += 2 * line.support_positions.size
    text = n_blocks * (_XDMF_BLOCK + _XDMF_FIELD * len(fields.kinds))
    values = share * snapshot_bytes(fields, extent)
    return _FIELD_TABLES + 40.0 * n_points + n_snapshots * (values + text + 32 * n_blocks)


def _tables(problem: Problem, recording: Recording) -> dict[str, tuple[Channel, int]]:
    """The growing tables of the result file: path -> channel and columns."""
    train = train_of(problem)
    table = {"time": (channels.TIME, 0), "line_channels/time": (channels.TIME, 0)}
    for channel in channels.train_channels(train):
        table[f"channels/{channel.name}"] = (channel, channel.n_columns(train))
    for name in recording.line.names:
        columns = recording.line.columns(_places(name, recording)).size
        table[f"line_channels/{name}"] = (channels.CHANNELS[name], columns)
    if recording.energy_every:
        table.update({f"energy/{c.name}": (c, 0) for c in channels.ENERGIES.values()})
    return table


def _places(name: str, recording: Recording) -> np.ndarray:
    return {
        channels.ARM: recording.extent.arm_x,
        channels.DROPPER: recording.extent.dropper_x,
        channels.WIRE_END: recording.end_x,
    }[channels.CHANNELS[name].per]


def _table_bytes(
    path: str, columns: int, shape: Chunk, problem: Problem, recording: Recording
) -> float:
    every = 1
    if path.startswith("line_channels/"):
        every = recording.line.every
    elif path.startswith("energy/"):
        every = recording.energy_every or 1
    n_rows = recording.n_steps // every + 1
    down, across = math.ceil(n_rows / shape.rows), math.ceil(max(columns, 1) / shape.columns)
    n_chunks = down * across
    name = path.rsplit("/", 1)[-1]
    if name not in channels.line_channels():
        return n_chunks * (_BYTES * shape.rows * shape.columns + _PER_CHUNK)
    if not columns:
        return 0.0
    x = _places(name, recording)
    own = _Moving(x[recording.line.columns(x)], n_rows, problem, recording)
    window = recording.line.window
    if window is not None:
        n_chunks = own.chunks(shape, window)
    if recording.line.compression != GZIP:
        return n_chunks * (_BYTES * shape.rows * shape.columns + _PER_CHUNK)
    near, far = _COMPRESSED.get(name, _INCOMPRESSIBLE)
    n_near, n_values = own.values(THINNED_WINDOW), float(n_rows * columns)
    if window is not None:
        n_near, n_values = min(n_near, own.values(window)), own.values(window)
    return _BYTES * (near * n_near + far * (n_values - n_near)) + n_chunks * _PER_CHUNK


class _Moving(NamedTuple):
    """Columns at ``x`` [m] of a table with ``n_rows``, while the train runs along."""

    x: np.ndarray
    n_rows: int
    problem: Problem
    recording: Recording

    def edges(
        self, first: np.ndarray, last: np.ndarray, window: tuple[float, float]
    ) -> tuple[np.ndarray, np.ndarray]:
        """From and to of a window from row ``first`` to row ``last`` [m]."""
        train = self.problem.train
        travel = self.recording.line.every * self.problem.numerics.dt * train.speed
        length = max(place.behind for place in train.placements)
        return (
            train.start + travel * first - length - window[0],
            train.start + travel * last + window[1],
        )

    def chunks(self, shape: Chunk, window: tuple[float, float]) -> int:
        """Chunks in which a column is within the window at one of the rows."""
        first = np.arange(0, self.n_rows, shape.rows)
        low, high = self.edges(first, np.minimum(first + shape.rows, self.n_rows) - 1, window)
        total = 0
        for start in range(0, self.x.size, shape.columns):
            block = self.x[start : start + shape.columns]
            total += int(np.count_nonzero((block.max() >= low) & (block.min() <= high)))
        return total

    def values(self, window: tuple[float, float]) -> float:
        """Values within the window, of all rows."""
        rows = np.linspace(0, self.n_rows - 1, min(self.n_rows, _SAMPLES))
        x = np.sort(self.x)
        low, high = self.edges(rows, rows, window)
        inside = np.searchsorted(x, high, side="right") - np.searchsorted(x, low)
        return float(inside.mean()) * self.n_rows
