"""Reads a result file, finished or not. Everything after the run goes through this reader."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from functools import cached_property
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from catenary.base.errors import InputError
from catenary.base.paths import is_file, is_folder, is_there
from catenary.meshgen.wires import Role
from catenary.postproc.channels.line_record import LineRecord
from catenary.postproc.files.filtered_force import filtered_in
from catenary.postproc.files.hdf5 import table_rows
from catenary.postproc.files.own_files import RUN_FILE
from catenary.postproc.files.run_schema import ALL_COLUMNS, DONE, LINE_TIME, PLACES, RUNNING
from catenary.postproc.read.line_of_run import ResultTables
from catenary.postproc.read.records import Records
from catenary.postproc.read.train_of_run import TrainOfRun
from catenary.postproc.read.validated_file import ValidatedFile
from catenary.solver.time_loop.views import channels

logger = logging.getLogger("catenary.results")


class Results(TrainOfRun):
    """A result file opened for reading. A context manager; not collective.

    All channels are cut to the rows that are whole, so that a file whose writer was killed reads
    like a shorter run.

    Parameters
    ----------
    path : the result file or the folder that holds it as ``run.h5``
    records : result of ``guard.examined``, None to check it here
    image : the bytes of the file, if a run of this process wrote it; it need not be there any more

    Raises
    ------
    InputError
        If there is no such file, if it is not a result file of this program, or if it is damaged
        so that no report can be made of it.
    """

    _latest: tuple[str, h5py.Dataset] | None = None

    def __init__(
        self, path: Path | str, records: Records | None = None, image: bytes | None = None
    ) -> None:
        path = Path(path)
        self.path = path / RUN_FILE if is_folder(path) else path
        if image is None and not is_file(self.path):
            what = "is no file" if is_there(self.path) else "does not exist"
            raise InputError(f"{self.path} {what}: name a result file or its folder")
        super().__init__(ValidatedFile(self.path, records, image))

    @classmethod
    def of(cls, tables: ResultTables) -> Results:
        """Results that are in memory and in no file."""
        results = cls.__new__(cls)
        results.path = Path()
        TrainOfRun.__init__(results, tables)
        return results

    def __enter__(self) -> Results:
        return self

    def __exit__(self, kind: object, error: object, trace: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def image(self) -> bytes:
        """The bytes of the file, for ``image`` of others."""
        assert isinstance(self._file, ValidatedFile)
        return self._file.image()

    # ---- what the run was -------------------------------------------------------------------

    @property
    def attributes(self) -> dict[str, Any]:
        """Root attributes, lists and tables decoded, numbers as Python's."""
        return self._file.attrs

    @property
    def damage(self) -> list[str]:
        """A sentence on the file's damage and its usable part, none if the file is valid."""
        return self._file.damage

    @property
    def outcome(self) -> str:
        """ "done", "interrupted", "running" (also if the program was killed), or what broke."""
        return str(self.attributes.get("outcome", RUNNING))

    @property
    def complete(self) -> bool:
        """Whether the run came to its planned end."""
        return self.outcome == DONE

    @property
    def dt(self) -> float:
        """Time step [s]."""
        return self.fact("time_step")

    def fact(self, name: str) -> float:
        """A fact of ``postproc.channels.facts``, NaN if the file was written without it.

        Of the run as a whole: see ``facts_of`` and ``facts_of_wires`` for others.
        """
        return float(self._file.facts[name])

    def facts_of_wires(self, name: str) -> dict[str, float]:
        """A fact of each contact wire by its name, NaN likewise."""
        wires = self.wires_of(Role.CONTACT)
        values = np.broadcast_to(self._file.facts[name], len(wires)).tolist()
        return dict(zip(wires, values, strict=True))

    @property
    def n_steps(self) -> int:
        """Steps recorded, without the initial state."""
        return max(self._length - 1, 0)

    @property
    def simulated(self) -> float:
        """Time between the first and the last record [s]."""
        clock, n = self._file["time"], self._length
        return float(clock[n - 1] - clock[0]) if n else 0.0

    # ---- channels ---------------------------------------------------------------------------

    @property
    def _length(self) -> int:
        return self._file.records.rows[0]

    @cached_property
    def _line_length(self) -> int:
        """Rows of the line's channels up to the last step."""
        n = self._file.records.rows[2]
        return min(n, (self._length - 1) // self.line_record.every + 1) if self._length else 0

    @property
    def line_record(self) -> LineRecord:
        """Recorded part of the line's channels."""
        return self._file.record

    @property
    def time(self) -> np.ndarray:
        """Times of the records, shape (n,) [s], read anew at each call."""
        return np.asarray(self._file["time"][: self._length])

    def time_at(self, row: int) -> float:
        """Time of a record [s]."""
        return float(self._file["time"][row])

    @property
    def line_time(self) -> np.ndarray:
        """Times of the rows of the line's channels, shape (m,) [s], read anew at each call."""
        n = self._line_length
        return np.asarray(self._file[LINE_TIME][:n]) if n else np.zeros(0)

    def n_rows(self, name: str) -> int:
        """Rows of a channel; those of the line may be fewer than the steps."""
        return self._line_length if _is_of_line(name) else self._length

    def channel(self, name: str) -> np.ndarray:
        """A channel of ``CHANNELS``, shape (n, columns), read anew at each call.

        What is not recorded of the line is NaN. Reads all of it into memory: see ``column`` and
        ``blocks``.
        """
        return self.rows(name, slice(0, self.n_rows(name)))

    def stored_filtered_force(
        self, index: int | None = None
    ) -> tuple[np.ndarray, dict[str, Any]] | None:
        """The filtered contact force (n, n_pantographs) [N], or (n,) of pantograph ``index``, and
        its filter.

        None where the file has no valid one: its run is not done, or its contact force is damaged.
        """
        if self._path("contact_force") in self._file.records.damaged:
            return None
        return filtered_in(self._file, (self._length, self.n_pantographs), index)

    def rows(self, name: str, part: slice) -> np.ndarray:
        """The rows ``part`` of channel ``name``, shape (rows, columns), NaN where it is damaged and
        where the line is not recorded."""
        n, table = len(range(*part.indices(self.n_rows(name)))), self._table(name)
        columns, n_places = self.recorded_columns(name), self._n_places(name)
        valid = self._valid(name, part)
        n_valid, all_there = valid.stop - valid.start, columns.size == n_places
        if table is not None and all_there and n_valid == n:
            return np.asarray(table[valid])
        whole = np.full((n, n_places), np.nan)
        if table is not None:
            whole[:n_valid, slice(None) if all_there else columns] = table[valid]
        return whole

    def column(self, name: str, index: int, part: slice | None = None) -> np.ndarray:
        """Column ``index`` of channel ``name``, all of its rows or ``part`` of them, from ``start``
        to ``stop``; NaN as in ``rows``."""
        part = slice(0, self.n_rows(name)) if part is None else part
        values = np.full(part.stop - part.start, np.nan)
        table, place = self._table(name), np.flatnonzero(self.recorded_columns(name) == index)
        if table is not None and place.size:
            valid = self._valid(name, part)
            n = valid.stop - valid.start
            values[:n] = table_rows.column(table, valid, int(place[0]))
        return values

    def blocks(self, name: str) -> Iterator[tuple[slice, np.ndarray]]:
        """All rows of a channel in order, by blocks: which rows, and their values as ``rows``."""
        table = self._table(name)
        step = table.chunks[0] if table is not None and table.chunks else 1
        for part in table_rows.row_blocks(self.n_rows(name), self._n_places(name), step):
            yield part, self.rows(name, part)

    def written_blocks(self, name: str) -> Iterator[tuple[slice, np.ndarray, np.ndarray]]:
        """The valid values of a channel by blocks of a few columns, whose rows come in order: which
        rows, numbers of the columns (c,), and values (rows, c).

        Without those blocks that a window left unwritten, which are NaN.
        """
        table = self._table(name)
        if table is None:
            return
        numbers = self.recorded_columns(name)
        valid, step = self._valid(name, slice(0, self.n_rows(name))), (table.chunks or (1,))[0]
        for first in range(0, numbers.size, table_rows.COLUMNS_AT_ONCE):
            columns = slice(first, min(first + table_rows.COLUMNS_AT_ONCE, numbers.size))
            for part in table_rows.row_blocks(valid.stop, columns.stop - first, step):
                if not table_rows.unwritten(table, part, columns):
                    yield part, numbers[columns], np.asarray(table[part, columns])

    def recorded_columns(self, name: str) -> np.ndarray:
        """Columns of a channel that its table has, (n,) int; all but of arms and droppers beyond
        the recorded stretch."""
        if _is_of_line(name) and name not in self.line_record.names:
            return np.zeros(0, dtype=np.int64)
        path = f"line_columns/{name}"
        if path in self._file:
            return np.asarray(self._file[path][...])
        return np.arange(self._n_places(name))

    def extremes(self, name: str) -> np.ndarray:
        """Smallest and largest value of each column of a channel, shape (2, columns).

        Over every step, whatever is recorded of the line; NaN if there are no steps.
        """
        of_line = _is_of_line(name)
        kept = (self._file.extremes(self._length) or {}) if of_line else {}
        if name in kept:
            return kept[name]
        table = self._table(name)
        if table is None or (of_line and not self.line_record.whole):
            return np.full((2, self._n_places(name)), np.nan)
        valid = self._valid(name, slice(0, self.n_rows(name)))
        return table_rows.extremes(table, valid.stop)

    def has(self, name: str) -> bool:
        """Whether a channel was recorded, and can be read."""
        return self._table(name) is not None

    def _path(self, name: str) -> str:
        return f"{'line_channels' if _is_of_line(name) else 'channels'}/{name}"

    def _table(self, name: str) -> h5py.Dataset | None:
        """The table of a channel, None if there is none that is valid."""
        path = self._path(name)
        if path not in self._file:
            return None
        # The latest is kept open: HDF5 forgets the chunks of one that is closed, and would read
        # them again for the next column.
        latest = self._latest  # another thread may ask for another table meanwhile
        if latest is None or latest[0] != path:
            latest = self._latest = path, self._file[path]
        return latest[1]

    def _valid(self, name: str, part: slice) -> slice:
        """The rows of a part that can be read."""
        start, stop, _ = part.indices(self.n_rows(name))
        n = self._file.records.damaged.get(self._path(name), stop)
        return slice(start, max(start, min(stop, n)))

    def _n_places(self, name: str) -> int:
        """Columns that a channel has if all are recorded."""
        channel = channels.CHANNELS[name]
        if not channel.of_line:
            n_wires = len(self.wires_of(Role.CONTACT))
            return channel.n_columns(channels.TrainLayout(tuple(self.n_strips()), n_wires=n_wires))
        path = PLACES[ALL_COLUMNS[channel.per]]
        return int(self._file[path].shape[0]) if path in self._file else 0

    @property
    def has_violations(self) -> bool:
        """Whether a pantograph has joints in the time loop."""
        return self.has("constraint_violation")

    def largest_violations(self) -> list[float | None]:
        """Largest open joint of each pantograph over the whole run, (n_pantographs,) [m]; None
        without joints in the time loop."""
        if not self.has_violations or not self._length:
            return [None] * self.n_pantographs
        found = self.extremes("constraint_violation")[1]
        return [None if np.isnan(largest) else float(largest) for largest in found]

    def energies(self) -> dict[str, np.ndarray]:
        """Energies by name, each (m,), empty if the run did not record them."""
        if not self._file.has_energies:
            return {}
        n = self._file.records.rows[1]
        there = (name for name in channels.ENERGIES if f"energy/{name}" in self._file)
        return {name: np.asarray(self._file[f"energy/{name}"][:n]) for name in there}

    # ---- to continue from ------------------------------------------------------------------

    @property
    def checkpoint(self) -> dict[str, Any]:
        """The latest valid state to continue from.

        Raises
        ------
        InputError
            If the file holds none.
        """
        assert isinstance(self._file, ValidatedFile)
        state, sentences = self._file.state()
        for sentence in sentences:
            logger.warning("%s", sentence)
        return state


def _is_of_line(name: str) -> bool:
    """Whether a channel has a column for each place on the line."""
    return name in channels.CHANNELS and channels.CHANNELS[name].of_line
