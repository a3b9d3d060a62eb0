"""Snapshots of the moving line for ParaView and films, taken while a run goes on.

Warp by the vector ``displacement`` to see the motion; the geometry is the line at rest.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from catenary.base.errors import RunBroken
from catenary.postproc.files.disk import broken_write
from catenary.postproc.record.file_observer import ColumnGather, FileObserver
from catenary.postproc.record.snapshots.contents import (
    Block,
    FieldRecord,
    RecordedLine,
    blocks_of,
)
from catenary.postproc.record.snapshots.field_values import FieldValues, Gathered
from catenary.postproc.record.snapshots.fields_file import FieldsFile
from catenary.solver.time_loop.views.observers import Stage, StepView

_MAX_BUFFER = 32 * 1024 * 1024


class FieldRecorder(FileObserver[FieldsFile]):
    """Observer that writes ``fields.xdmf`` and the ``.h5`` beside it.

    Collective, like all its methods except ``observe`` between flushes. Both files are valid after
    every flush.

    Parameters
    ----------
    comm : mpi4py communicator
    path_xdmf : the XDMF file; the numbers go into the file of the same name ending in ``.h5``;
        its folder is made
    line : parts of the line that snapshots show
    every : steps between two snapshots
    record : which part of it is recorded
    flush_every : steps after which what is kept in memory is written; if it is the ``Recorder``'s,
        which is to follow in the list of observers, a killed run can be continued without a gap
    resume : continue the files: snapshots from the stage's start time on are replaced
    wait : keep new files under another name, and others as they are, until ``publish`` is called

    Attributes
    ----------
    most_kept : snapshots after which what is kept in memory is written, if that is not large
    """

    most_kept = 50

    def __init__(
        self,
        comm: Any,
        path_xdmf: Path | str,
        line: RecordedLine,
        *,
        every: int,
        record: FieldRecord | None = None,
        flush_every: int = 500,
        resume: bool = False,
        wait: bool = False,
    ) -> None:
        super().__init__(comm, flush_every)
        self._xdmf = Path(path_xdmf)
        self._line, self._every = line, every
        self._record = record or FieldRecord()
        self._resume, self._wait = resume, wait
        self._buffered: list[float] = []
        self._tension: list[np.ndarray] = []
        self._pantographs: list[np.ndarray] = []
        kinds = self._record.kinds
        self._wants_tension = any(kind.name == "tension" for kind in kinds)
        self._wants_droppers = any(kind.of_droppers for kind in kinds)

    def start(self, stage: Stage) -> None:
        """Write the mesh. Collective.

        Raises
        ------
        RunBroken
            On all ranks, if the files cannot be written.
        """
        self._first_step = round(stage.start_time / stage.dt)
        wanted = (kind.motions_of(stage.unknowns) for kind in self._record.kinds)
        motions = sorted({motion for of_kind in wanted for motion in of_kind})
        n_nodes = int(stage.node_points.shape[0])
        n_bytes = 8 * n_nodes * max(1, len(motions))
        self._capacity = max(1, min(self.most_kept, _MAX_BUFFER // n_bytes))
        self._owned_nodes, self._apart = stage.owned_nodes, self._every * stage.dt
        # Of a part of the line its nodes alone are kept; a window's change from flush to flush.
        self._among: np.ndarray | None = None
        self._own: np.ndarray | None = None
        self._blocks: list[Block] = []
        if not self._record.is_whole:
            self._blocks = self._record.chosen(blocks_of(self._line, stage.node_points))
        self._n_nodes = n_nodes
        gather = ColumnGather(self._comm, stage.owned_nodes, n_nodes, self._capacity)
        self._motions = {
            motion: (gather.twin(), np.zeros((self._capacity, gather.n_owned)))
            for motion in motions
        }
        if self._wants_droppers:
            owned, n = stage.owned_droppers, int(stage.dropper_x.size)
            self._droppers = ColumnGather(self._comm, owned, n, self._capacity)
            self._force = np.zeros((self._capacity, self._droppers.n_owned))
        self._guarded(
            lambda: self._open(stage), lambda error: self._failed(error, stage.start_time)
        )

    def next_motion(self, step: int) -> int:
        """The step of the next snapshot."""
        return step - step % self._every + self._every

    def observe(self, view: StepView) -> None:
        """Keep a snapshot if one is due; collective when the buffer is to be written."""
        if view.step % self._every == 0:
            self._keep(view, len(self._buffered))
            self._buffered.append(view.time)
            if len(self._buffered) == self._capacity:
                self._flush()
        # The first snapshot is written at once, so that ParaView can open the files.
        due = view.step == self._first_step or (view.step + 1) % self._flush_every == 0
        if due and self._buffered:
            self._flush()

    def finish(self, outcome: str) -> None:
        """Write what is left. Collective."""
        try:
            if not self._broken:
                self._flush()
        finally:
            if self._file is not None:
                self._file.close()

    def publish(self) -> None:
        """Give new files their names, in place of earlier ones. On rank 0; not collective.

        Raises
        ------
        OSError
        """
        if self._file is not None:
            self._file.publish()

    def _keep(self, view: StepView, row: int) -> None:
        if row == 0 and self._blocks:
            span = np.array([view.time, view.time + self._capacity * self._apart])
            self._among = self._record.needed(self._blocks, span, self._n_nodes)
            self._own = np.flatnonzero(self._among[self._owned_nodes])
        for (name, rate), (_, kept) in self._motions.items():
            if self._own is None:
                kept[row] = view.node_motion(name, rate)
            else:
                kept[row, : self._own.size] = view.node_motion(name, rate, self._own)
        if self._wants_droppers:
            self._force[row] = view.dropper_force
        if self._wants_tension:
            self._tension.append(view.wire_tension())
        if self._comm.rank == 0:
            self._pantographs.append(view.pantograph_places())

    def _flush(self) -> None:
        times, rows = list(self._buffered), len(self._buffered)
        motions = {}
        for motion, (gather, kept) in self._motions.items():
            if self._own is not None:
                kept = np.ascontiguousarray(kept[:rows, : self._own.size])
            motions[motion] = gather(kept[:rows], self._among)
        force = self._droppers(self._force[:rows]) if self._wants_droppers else np.zeros((rows, 0))
        places = np.array(self._pantographs)
        known = Gathered(motions, force, self._tension, places)
        self._buffered.clear()
        if times:
            self._guarded(
                lambda: self._open_file.append(times, known),
                lambda error: self._failed(error, times[-1]),
            )
        self._tension, self._pantographs = [], []

    # ---- rank 0 ------------------------------------------------------------------------------

    def _open(self, stage: Stage) -> None:
        points, every = stage.node_points, (self._every, stage.dt)
        values = FieldValues(self._line, points)
        blocks = blocks_of(self._line, points)
        sizes = len(points), stage.n_places
        file = FieldsFile(self._xdmf, self._record, blocks, values, *sizes, every)
        # Numbers of the snapshots to come.
        first = -(-self._first_step // self._every)
        numbers = np.arange(first, max(first, stage.n_steps // self._every) + 1)
        self._file = file
        if self._resume and file.resume(numbers, stage.start_time):
            return
        file.make(numbers)
        if self._resume or not self._wait:
            file.publish()

    def _failed(self, error: Exception, time: float) -> RunBroken:
        begun = self._resume or (self._file is not None and self._file.is_published)
        return broken_write(self._xdmf.with_suffix(".h5"), time, error, begun)
