"""Needs of a run, estimated before anything is made: time, memory and room for its files.

Sizes of files follow from the shapes in which they are written. What HDF5 and the report add beyond
that was measured on runs of the shipped cases.
"""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from heapq import nlargest
from typing import NamedTuple

import numpy as np

from catenary.cases.result_folder.output_folder import RunSize
from catenary.cases.run.recording import (
    THINNED_WINDOW,
    Extent,
    Recording,
    extent_before_meshing,
    extent_of,
    recording_of,
    shown_share,
    snapshot_bytes,
    train_of,
)
from catenary.cases.scene.checks.mesh_size import estimate_march, estimate_memory, size_of
from catenary.cases.scene.scene import Scene, problem_of, resolved
from catenary.mbs.lumped import LumpedData
from catenary.meshgen.mesh import LineMesh
from catenary.postproc.files.header import GZIP
from catenary.postproc.files.run_schema import Chunk, chunks_of
from catenary.solver.effects import all_effects as effects
from catenary.solver.effects.build_model import numbering_of
from catenary.solver.integrators.slow_path import SlowPath, single_steps_of, slow_path_of
from catenary.solver.problem.problem import Problem
from catenary.solver.problem.watched_links import GAUGES
from catenary.solver.time_loop.views import channels
from catenary.solver.time_loop.views.channels import Channel
from catenary.solver.window.choice import moving_share

_BYTES = 8  # of a number
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
# Time between two flushes of the result file at full speed, each of which takes some 5 ms [s], and
# what may wait for one in memory [B].
FLUSH_EVERY = 0.2
FLUSH_MEMORY = 1e8
# Time to write the state to continue from [s an unknown], and what it may take of a march with a
# window.
STATE_PER_UNKNOWN, STATE_SHARE = 1e-7, 0.05
# Steps of a flush whose chunks are not too small.
LEAST_FLUSH = 256
_PER_PANTOGRAPH = 8  # channels of a pantograph, mostly at most


@dataclass(frozen=True)
class Needs:
    """Needs of a run.

    Attributes
    ----------
    n_steps : number of steps
    memory : resident memory on one rank [B]
    march : wall time of the time loop on one rank [s]
    files : sizes of the files
    recording : records of the run
    slow_path : why steps of the line take longer than they could, None if they do not
    """

    n_steps: int
    memory: float
    march: float
    files: FileSizes
    recording: Recording
    slow_path: SlowPath | None = None


class Kept(NamedTuple):
    """A run of several, and what of it stays on the disk beside summary and snapshots."""

    scene: Scene
    result: bool
    report: bool


class NeedsOfRuns(NamedTuple):
    """Needs of several runs.

    Attributes
    ----------
    n_runs : how many there are
    march : of all together, and of the longest, on one rank [s]
    memory : of the largest on one rank [B]
    """

    n_runs: int
    march: tuple[float, float]
    memory: float


def _needs_of(
    scene: Scene,
    problem: Problem,
    extent: Extent,
    n_dofs: int,
    stations: Mapping[int, int] | None = None,
    slow_path: SlowPath | None = None,
) -> Needs:
    """Needs of a run of a scene whose line has ``n_dofs`` unknowns.

    ``stations`` says how many have each number of unknowns; by default all have a node of each wire
    that has unknowns of its own. ``slow_path`` is why steps take longer than they could.
    """
    active = effects.active(problem)
    if not stations:
        together = effects.move_together(problem)
        own = [wire for wire in problem.line.wires if wire.name not in together]
        groups = effects.unknown_groups(active, own)
        stations = {sum(len(names) for group in groups for names in group.values()): 1}
    scheme, n_substeps = problem.numerics.scheme, _substeps(problem)
    gusts = problem.wind is not None and problem.wind.gusts is not None
    n_moving, by_motion = round(n_dofs * moving_share(problem)), problem.window.by_motion > 0.0
    n_steps = max(1, math.floor(simulated_time(problem) / problem.numerics.dt + 1e-9))
    recording = recording_of(scene.output, problem, extent, n_steps)
    flush_every = scene.output.flush_every_steps or flush_cadence(problem, n_dofs, recording)
    return Needs(
        n_steps=n_steps,
        memory=estimate_memory(n_dofs, n_steps, problem.window.moves and not by_motion),
        # Substeps are counted by themselves.
        march=(1.0 if slow_path is None or n_substeps else slow_path.factor)
        * estimate_march(n_moving, n_steps, scheme, n_substeps, stations, gusts),
        files=_estimate_files(scene, problem, recording, n_dofs, flush_every),
        recording=recording,
        slow_path=slow_path,
    )


def _substeps(problem: Problem) -> int:
    """Substeps in a step of all pantographs whose bodies are all moved."""
    kinds = [place.data for place in problem.train.placements]
    ways = [kind.all_bodies for kind in kinds if not isinstance(kind, LumpedData)]
    return sum(way.substeps for way in ways if way is not None)


def simulated_time(problem: Problem) -> float:
    """From the start of a run to its end [s]."""
    train = problem.train
    return (train.end - train.start) / train.speed


def needs_before_meshing(scene: Scene, problem: Problem | None = None) -> Needs | None:
    """Needs of a run from its scene alone; None if that brings its own mesh.

    Not collective. ``problem`` is the scene's unless another one is run on its line.
    """
    size = size_of(scene)
    if size is None:
        return None
    problem = problem or problem_of(scene)
    extent = extent_before_meshing(problem.line, size.nodes)
    return _needs_of(scene, problem, extent, size.unknowns)


def needs_with_mesh(scene: Scene, mesh: LineMesh) -> Needs:
    """Needs of a run on a mesh. Not collective."""
    problem = problem_of(scene)
    numbering = numbering_of(problem, mesh)
    slow_path = slow_path_of(problem, numbering) or single_steps_of(problem)
    extent = extent_of(mesh)
    stations: Counter[int] = Counter()
    for places, count in zip(
        numbering.station_types, np.bincount(numbering.station_type), strict=True
    ):
        stations[len(places)] += int(count)
    return _needs_of(scene, problem, extent, numbering.n_unknowns, stations, slow_path)


def run_size(needs: Needs) -> RunSize:
    """Size of one run with its report."""
    return RunSize(needs.files.total, needs.march, needs.n_steps)


def total_size(runs: Iterable[Kept], n_at_once: int = 1) -> RunSize:
    """Size of several runs, ``n_at_once`` of which are made at the same time. Not collective.

    Of result files that are deleted after their run the ``n_at_once`` largest count. Runs whose
    scenes bring their own mesh, which is not read here, do not count.
    """
    left = seconds = 0.0
    n_steps = 0
    passing = []
    for run in runs:
        needs = needs_before_meshing(run.scene)
        if needs is None:
            continue
        files = needs.files
        left += files.film + (files.report if run.report else 0.0)
        left += files.result if run.result else 0.0
        passing.append(0.0 if run.result else files.result)
        seconds += needs.march
        n_steps += needs.n_steps
    return RunSize(left + sum(nlargest(n_at_once, passing)), seconds, n_steps)


def total_needs(scenes: Iterable[Scene]) -> NeedsOfRuns:
    """Needs of several runs together. Not collective.

    Those of scenes that bring their own mesh count as the longest and largest of the others.
    """
    known = [needs_before_meshing(scene) for scene in scenes]
    found = [needs for needs in known if needs is not None]
    longest = max((needs.march for needs in found), default=0.0)
    total = sum(needs.march for needs in found) + (len(known) - len(found)) * longest
    memory = max((needs.memory for needs in found), default=0.0)
    return NeedsOfRuns(len(known), (total, longest), memory)


def flush_cadence(problem: Problem, n_dofs: int, recording: Recording) -> int:
    """Steps between two flushes of the result file: about 0.2 s of wall time on one rank.

    At most the steps that fit into memory, and a whole number of chunks that are not small. With a
    window steps are cheap and the interval is longer, so that writing the state of the whole line
    takes a small share of the time. Files do not depend on the number of ranks.

    Parameters
    ----------
    problem : the problem of the run
    n_dofs : number of unknowns of the whole line
    recording : recorded places and cadence
    """
    n_moving = round(n_dofs * moving_share(problem))
    step = estimate_march(n_moving, 1, problem.numerics.scheme, _substeps(problem))
    spent = FLUSH_EVERY
    if problem.window.moves:
        spent = max(spent, STATE_PER_UNKNOWN * n_dofs / STATE_SHARE)
    wanted = max(round(spent / step), LEAST_FLUSH)
    steps = max(1, min(wanted, _steps_in_memory(problem, recording)))
    for part in (LEAST_FLUSH * recording.line.every, LEAST_FLUSH, recording.line.every):
        if steps >= part:
            return steps - steps % part
    return steps


def _steps_in_memory(problem: Problem, recording: Recording) -> int:
    """Steps whose channels fit into memory."""
    of_train = _PER_PANTOGRAPH * len(problem.train.placements)
    arm_x, dropper_x, *_ = recording.extent
    columns = arm_x.size + dropper_x.size + len(GAUGES) * recording.end_x.size
    window, masts = recording.line.window, problem.line.support_positions
    if window is None or not problem.window.moves:
        return int(FLUSH_MEMORY / (_BYTES * (of_train + columns)))
    # Of n steps the columns near the train: those at first, and those that it comes to.
    per_metre = columns / (masts[-1] - masts[0]) / recording.line.every
    behind = [placement.behind for placement in problem.train.placements]
    at_first = of_train + per_metre * (sum(window) + max(behind) - min(behind))
    later = per_metre * problem.train.speed * problem.numerics.dt
    room = FLUSH_MEMORY / _BYTES
    return int((math.sqrt(at_first**2 + 4.0 * later * room) - at_first) / (2.0 * later))


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


def _estimate_files(
    scene: Scene, problem: Problem, recording: Recording, n_dofs: int, flush_every: int
) -> FileSizes:
    """Sizes of the files of a run of a line of ``n_dofs`` unknowns, with so many steps between two
    flushes."""
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
