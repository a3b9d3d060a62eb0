"""Snapshots of the moving line for ParaView: HDF5 for the numbers, XDMF for their meaning.

Readers accept one dataset per snapshot and ``Polyline`` cells of two nodes; hyperslabs of one big
dataset lose their arrays silently in the Xdmf3 reader, hence the layout. Warp by the vector
``displacement`` to see the motion; the geometry is the line at rest.
"""

from __future__ import annotations

import contextlib
import logging
import os
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from h5py import h5d, h5p, h5s, h5t

from catenary.meshgen.mesh import DROPPERS, elements_of
from catenary.postproc.files.disk import (
    MARGIN,
    broken_write,
    check_in_place,
    opened,
    reserve,
    write_at,
)
from catenary.postproc.files.own_files import part_of
from catenary.postproc.read.guard import survives
from catenary.postproc.record.column_gather import ColumnGather, next_flush
from catenary.postproc.record.growing_xdmf import GrowingXdmf, snapshot_name
from catenary.solver.base.errors import RunBroken
from catenary.solver.base.parallel import on_root
from catenary.solver.time_loop.observers import Stage, StepView

logger = logging.getLogger("catenary.fields")

_MAX_BUFFER = 32 * 1024 * 1024
# More than HDF5's tables take for a dataset (about 400) [bytes].
_TABLES = 1024


class FieldRecorder:
    """Observer that writes ``fields.xdmf`` and the ``.h5`` beside it.

    Collective, like all its methods except ``observe`` between flushes. Both files are valid after
    every flush.

    Parameters
    ----------
    comm : mpi4py communicator
    path_xdmf : the XDMF file; the numbers go into the file of the same name ending in ``.h5``;
        its folder is made
    wires : name -> (n,) int, nodes of each wire in order of x
    droppers : (n_droppers, 2) int, upper and lower node of each
    breaks : name -> places in ``wires[name]`` where further pieces of the wire begin
    every : steps between two snapshots
    flush_every : steps after which what is kept in memory is written; if it is the ``Recorder``'s,
        which is to follow in the list of observers, a killed run can be continued without a gap
    snapshots_per_flush : most snapshots kept in memory
    resume : continue the files: snapshots from the stage's start time on are replaced
    wait : keep new files under another name, and others as they are, until ``publish`` is called
    """

    def __init__(
        self,
        comm: Any,
        path_xdmf: Path | str,
        wires: Mapping[str, np.ndarray],
        droppers: np.ndarray,
        *,
        every: int,
        breaks: Mapping[str, np.ndarray] | None = None,
        flush_every: int = 500,
        snapshots_per_flush: int = 50,
        resume: bool = False,
        wait: bool = False,
    ) -> None:
        self._comm = comm
        self._xdmf = Path(path_xdmf)
        self._h5 = self._xdmf.with_suffix(".h5")
        self._cells, self._component = line_cells(wires, droppers, breaks or {})
        self._every = every
        self._flush_every = flush_every
        self._capacity = snapshots_per_flush
        self._resume = resume
        self._buffered: list[float] = []
        self._written: list[float] = []
        self._xdmf_text: GrowingXdmf | None = None
        self._broken = False
        self._handle = -1
        self._wait = wait
        self._published = False

    def start(self, stage: Stage) -> None:
        """Write the mesh. Collective.

        Raises
        ------
        RunBroken
            On all ranks, if the files cannot be written.
        """
        self._first_step = round(stage.start_time / stage.dt)
        self._n_snapshots = stage.n_steps // self._every + 1
        self._n_nodes = int(stage.node_points.shape[0])
        self._capacity = max(1, min(self._capacity, _MAX_BUFFER // (8 * self._n_nodes)))
        self._gather = ColumnGather(self._comm, stage.owned_nodes, self._n_nodes, self._capacity)
        self._uplift = np.zeros((self._capacity, self._gather.n_owned))
        self._guarded(lambda: self._open(stage), stage.start_time)

    def next_state(self, step: int) -> int:
        """The step of the next flush."""
        return next_flush(step, self._flush_every)

    def next_motion(self, step: int) -> int:
        """The step of the next snapshot."""
        return step - step % self._every + self._every

    def observe_rows(self, first_step: int, times: np.ndarray, rows: np.ndarray) -> None:
        """Pass over steps between two snapshots."""

    def observe(self, view: StepView) -> None:
        """Keep a snapshot if one is due; collective when the buffer is to be written."""
        if view.step % self._every == 0:
            self._uplift[len(self._buffered)] = view.node_uplift()
            self._buffered.append(view.time)
        # The first snapshot is written at once, so that ParaView can open the files.
        due = view.step == self._first_step or (view.step + 1) % self._flush_every == 0
        if len(self._buffered) == self._capacity or (due and self._buffered):
            self._flush()

    def finish(self, outcome: str) -> None:
        """Write what is left. Collective."""
        try:
            if not self._broken:
                self._flush()
        finally:
            self._close()

    def publish(self) -> None:
        """Give new files their names, in place of earlier ones. On rank 0; not collective.

        Raises
        ------
        OSError
        """
        if self._handle < 0 or self._published:
            return
        os.replace(self._made_as, self._h5)
        self._published = True
        self._describe()

    def _flush(self) -> None:
        times = list(self._buffered)
        uplift = self._gather(self._uplift[: len(times)])
        self._buffered.clear()
        if times:
            self._guarded(lambda: self._append(times, uplift), times[-1])

    def _guarded(self, work: Callable[[], None], time: float) -> None:
        """Run ``work`` on rank 0; if it fails, all ranks raise RunBroken. Collective."""

        def attempt() -> None:
            try:
                work()
            except (OSError, RuntimeError) as error:
                raise broken_write(self._h5, time, error) from error

        try:
            on_root(self._comm, attempt)
        except RunBroken:
            self._broken = True
            raise

    # ---- rank 0 ------------------------------------------------------------------------------

    def _open(self, stage: Stage) -> None:
        self._h5.parent.mkdir(parents=True, exist_ok=True)
        self._made_as = part_of(self._h5, os.getpid())
        first = -(-self._first_step // self._every)
        numbers = np.arange(first, stage.n_steps // self._every + 1)
        # Times of the snapshots to come.
        self._planned: list[float] = (self._every * numbers * stage.dt).tolist()
        if self._resume and self._h5.exists() and self._cut(stage):
            self._handle = os.open(self._h5, os.O_RDWR)
            self._published = True
            self._planned = [*self._written, *self._planned][: self._n_snapshots]
            self._describe()
            return
        try:
            self._make(stage)
        except BaseException:
            self._made_as.unlink(missing_ok=True)
            raise
        self._handle = os.open(self._made_as, os.O_RDWR)
        if self._resume or not self._wait:
            self.publish()

    def _make(self, stage: Stage) -> None:
        """Write a file without a snapshot."""
        with opened(self._made_as, "w") as file:
            reserve(file.id.get_vfd_handle(), 0, self._size())
            file["mesh/points"] = stage.node_points
            file["mesh/cells"] = self._cells
            file["mesh/component"] = self._component
            file["times"] = np.full(self._n_snapshots, np.nan)
            self._make_places(file)
        with h5py.File(self._made_as, "r") as file:
            self._find_places(file)

    def _close(self) -> None:
        """Close the file, remove one that was never published."""
        if self._handle < 0:
            return
        os.close(self._handle)
        self._handle = -1
        if self._xdmf_text is not None:
            self._xdmf_text.close()
        if not self._published:
            with contextlib.suppress(OSError):
                self._made_as.unlink(missing_ok=True)

    def _size(self) -> int:
        """What the file takes at most [bytes]."""
        return _film_bytes(self._n_nodes, len(self._cells), self._n_snapshots)

    def _make_places(self, file: h5py.File) -> None:
        # Room in the file now, and no zeros written into it.
        how = h5p.create(h5p.DATASET_CREATE)
        how.set_alloc_time(h5d.ALLOC_TIME_EARLY)
        how.set_fill_time(h5d.FILL_TIME_NEVER)
        n = self._n_nodes
        kinds = [
            (file.create_group(name).id, h5s.create_simple(shape))
            for name, shape in (("uplift", (n,)), ("displacement", (n, 3)))
        ]
        for number in range(self._n_snapshots):
            for group, space in kinds:
                h5d.create(group, snapshot_name(number).encode(), h5t.IEEE_F32LE, space, how)

    def _find_places(self, file: h5py.File) -> None:
        """Where in the file the times and the snapshots are [bytes]; KeyError without one."""
        self._times_at = file["times"].id.get_offset()
        kinds = [file[name].id for name in ("uplift", "displacement")]
        self._places = [
            [h5d.open(group, snapshot_name(number).encode()).get_offset() for group in kinds]
            for number in range(self._n_snapshots)
        ]

    def _cut(self, stage: Stage) -> bool:
        """Drop the snapshots from the stage's start on; False if the file is not as it was."""
        try:
            if not survives(self._h5):
                raise ValueError("HDF5 does not read it")
            with opened(self._h5, "r+") as file:
                times = file["times"]
                keep = int(np.sum(times[...] < stage.start_time - 0.5 * stage.dt))
                self._find_places(file)
                self._check(file, times[:keep], stage)
                times[keep:] = np.full(self._n_snapshots - keep, np.nan)
                self._written = times[:keep].tolist()
        except (OSError, KeyError, RuntimeError, TypeError, ValueError):
            logger.warning(
                "%s cannot be continued, it is damaged or of another version: its snapshots now "
                "begin at t = %.3f s",
                self._h5,
                stage.start_time,
            )
            return False
        return True

    def _check(self, file: h5py.File, times: np.ndarray, stage: Stage) -> None:
        """Raise ValueError if a file that is to be continued is not of this run and these places.

        Parameters
        ----------
        times : of the snapshots that are kept [s]
        """
        apart = np.diff(times) - self._every * stage.dt
        if not (np.abs(apart) <= 0.5 * stage.dt).all() or not np.isfinite(times).all():
            raise ValueError("times")
        points = file["mesh/points"][...]
        if points.shape != stage.node_points.shape or not np.isfinite(points).all():
            raise ValueError("mesh")
        # Snapshots are written where they stand: none may reach into another, or beyond the file.
        sizes = [4 * self._n_nodes, 12 * self._n_nodes]
        places = np.array(self._places, dtype=np.int64)
        ends = places + sizes
        order = np.argsort(places, axis=None)
        if (ends.flat[order[:-1]] > places.flat[order[1:]]).any() or (
            ends.max(initial=0) > self._h5.stat().st_size
        ):
            raise ValueError("places")

    def _append(self, times: list[float], uplift: np.ndarray) -> None:
        first = len(self._written)
        scalar = np.zeros(self._n_nodes, dtype="<f4")
        vector = np.zeros((self._n_nodes, 3), dtype="<f4")
        for (scalar_at, vector_at), values in zip(self._places[first:], uplift, strict=False):
            scalar[:] = vector[:, 2] = values
            write_at(self._handle, scalar_at, scalar)
            write_at(self._handle, vector_at, vector)
        write_at(self._handle, self._times_at + 8 * first, np.array(times, dtype="<f8"))
        self._written += times
        if self._published:
            check_in_place(self._h5, self._handle)
            self._describe()

    def _describe(self) -> None:
        """List in the XDMF file the snapshots that are there."""
        if self._xdmf_text is None:
            size = self._n_nodes, self._cells.shape[0]
            of = self._xdmf, self._h5.name, *size, self._planned
            self._xdmf_text = GrowingXdmf(*of, len(self._written))
        self._xdmf_text.show(len(self._written))


def _film_bytes(n_nodes: int, n_cells: int, n_snapshots: int) -> int:
    """What the file of the numbers takes at most [B]."""
    mesh = 3 * 8 * n_nodes + 3 * 4 * n_cells
    return mesh + n_snapshots * (4 * 4 * n_nodes + 8 + 2 * _TABLES) + MARGIN


def component_numbers(wires: Iterable[str]) -> dict[str, int]:
    """Number of each component: the wires in the order of their names, then the droppers."""
    return {name: number for number, name in enumerate([*sorted(wires), DROPPERS])}


def line_cells(
    wires: Mapping[str, np.ndarray], droppers: np.ndarray, breaks: Mapping[str, np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Line cells (n_cells, 2) int32 of wires and droppers, and component of each, (n_cells,) int32.

    Not collective.
    """
    none, numbers = np.zeros(0, dtype=np.int64), component_numbers(wires)
    parts = [(name, elements_of(nodes, breaks.get(name, none))) for name, nodes in wires.items()]
    parts.append((DROPPERS, np.asarray(droppers).reshape(-1, 2)))
    component = [np.full(len(cells), numbers[name]) for name, cells in parts]
    return (
        np.concatenate([cells for _, cells in parts]).astype(np.int32),
        np.concatenate(component).astype(np.int32),
    )
