"""Results of a run, finished or not. Everything after the run goes through this reader.

`LineOfRun` has what is written of the line once: its shape, and its values at rest. `TrainOfRun`
adds the pantographs in running order, their strips, and their columns; `Results` adds facts,
channels, extremes, energies, and the state to continue from.
"""

from __future__ import annotations

import itertools
import logging
from collections.abc import Iterator
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import h5py
import numpy as np

from catenary.base.errors import InputError
from catenary.base.files import is_file, is_folder, is_there
from catenary.meshgen.mesh import elements_of
from catenary.meshgen.wires import Role
from catenary.postproc.files import hdf5
from catenary.postproc.files.committed_rows import filtered_in
from catenary.postproc.files.header import LineRecord, places_on_train
from catenary.postproc.files.own_files import RUN_FILE
from catenary.postproc.files.run_schema import ALL_COLUMNS, DONE, LINE_TIME, PLACES, RUNNING
from catenary.postproc.read.registration import Registration
from catenary.postproc.read.result_tables import MarchedFile, ValidatedFile
from catenary.postproc.read.validation import Records
from catenary.solver.time_loop.views import channels

logger = logging.getLogger("catenary.results")

# Places along the line come from sums of span lengths, which round by far less [m].
_ROUNDING = 1e-6
# The tables of a result file, which is open and valid, or of a march that wrote none.
ResultTables = ValidatedFile | MarchedFile


def in_stretch(x: np.ndarray, start: float, end: float) -> np.ndarray:
    """Whether places ``x`` (n,) of the line are in a stretch, its ends included, (n,) bool."""
    return np.asarray((x >= start - _ROUNDING) & (x <= end + _ROUNDING))


class ContactProfile(NamedTuple):
    """A contact wire at rest.

    Attributes
    ----------
    breaks : places among its nodes at which further pieces of it begin
    x, height : of its nodes along the track, and above the rail [m]
    y : of its nodes to the left [m]; None where no wire moves sideways
    """

    breaks: np.ndarray
    x: np.ndarray
    height: np.ndarray
    y: np.ndarray | None = None

    def pieces(self) -> list[slice]:
        """Its nodes, piece by piece."""
        ends = [0, *self.breaks.tolist(), self.x.size]
        return [slice(*pair) for pair in itertools.pairwise(ends) if pair[0] < pair[1]]

    def height_at(self, x: np.ndarray) -> np.ndarray:
        """Height of its lowest piece at places ``x`` along the track [m], infinite where it has
        none."""
        height = np.full(np.shape(x), np.inf)
        for own in self.pieces():
            piece = np.interp(x, self.x[own], self.height[own], np.inf, np.inf)
            height = np.minimum(height, piece)
        return height

    def drawn(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Places along the track and values at the nodes, with a gap between pieces."""
        x = np.insert(self.x, self.breaks, self.x[self.breaks])
        return x, np.insert(values, self.breaks, np.nan)


class LineOfRun:
    """Constants of a result file that is open. Not collective.

    Parameters
    ----------
    file : ResultTables
    """

    def __init__(self, file: ResultTables) -> None:
        self._file = file

    def line(self, name: str) -> np.ndarray:
        """A dataset of ``/line``, for instance ``support_x``."""
        return np.asarray(self._file[f"line/{name}"][...])

    def wires(self) -> dict[str, np.ndarray]:
        """Node numbers of each wire in order of x."""
        return {name: np.asarray(nodes[...]) for name, nodes in self._file["line/wires"].items()}

    @property
    def roles(self) -> dict[str, Role]:
        """The role of each wire by its name, in the order of the line."""
        return {name: Role(role) for name, role in self._file.attrs["wires"].items()}

    def wires_of(self, role: Role) -> list[str]:
        """Names of the wires of a role, in the order of the line."""
        return [name for name, own in self.roles.items() if own is role]

    def contact_profiles(self) -> dict[str, ContactProfile]:
        """Each contact wire at rest by its name."""
        names, wires = self.wires_of(Role.CONTACT), self.wires()
        ends = np.cumsum([wires[name].size for name in names])[:-1]
        columns = [
            np.split(self.static(f"contact_{own}"), ends)
            for own in ("x", "height", "y")
            if own != "y" or self.has_static("contact_y")
        ]
        return {
            name: ContactProfile(self._breaks(name), *own)
            for name, *own in zip(names, *columns, strict=True)
        }

    def elements(self) -> dict[str, np.ndarray]:
        """Nodes of the elements of each wire, (n, 2) each, in order of x."""
        return {name: elements_of(own, self._breaks(name)) for name, own in self.wires().items()}

    def _breaks(self, wire: str) -> np.ndarray:
        """Places among the nodes of a wire at which further pieces of it begin."""
        path = f"line/breaks/{wire}"
        return np.asarray(self._file[path][...] if path in self._file else [], dtype=np.int64)

    def static(self, name: str) -> np.ndarray:
        """A dataset of ``/static``, for instance ``dropper_length``."""
        return np.asarray(self._file[f"static/{name}"][...])

    def has_static(self, name: str) -> bool:
        """Whether ``/static`` has a dataset, which lines may be without."""
        return f"static/{name}" in self._file

    def registration(self) -> Registration | None:
        """Steady arms at rest; None of straight wires."""
        if not self.has_static("arm_force"):
            return None
        names = ("arm_stagger", "arm_force", "arm_tension")
        table = {name: self.static(name) for name in names}
        known = {"arm_x": self.line("arm_x"), "arm_wire": self.line("arm_wire")}
        return Registration.of({**table, **known}, list(self.roles))

    def arm_wires(self) -> list[str]:
        """Name of the wire that each steady arm holds."""
        names = list(self.roles)
        return [names[number] for number in self.line("arm_wire").tolist()]

    def dropper_wires(self) -> np.ndarray:
        """Numbers of the upper and the lower wire of each dropper, (n_droppers, 2)."""
        of_node = np.zeros(self.line("node_points").shape[0], dtype=np.int64)
        wires = self.wires()
        for number, name in enumerate(self.roles):
            of_node[wires[name]] = number
        return of_node[self.line("droppers")].reshape(-1, 2)

    @cached_property
    def evaluation(self) -> tuple[float, float]:
        """From and to of the stretch whose statistics are judged [m]."""
        start, end = self.line("evaluation_range")
        return float(start), float(end)

    @cached_property
    def reference_span(self) -> int:
        """The span that is shown for all, counted from 0: the one in the middle of the evaluation
        stretch, or the nearest to it outside of overlaps."""
        masts = self.line("support_x")
        middle = 0.5 * sum(self.evaluation)
        span = int(np.clip(np.searchsorted(masts, middle, side="right") - 1, 0, masts.size - 2))
        middles = 0.5 * (masts[:-1] + masts[1:])
        heights = [wire.height_at(middles) for wire in self.contact_profiles().values()]
        wires = np.isfinite(heights).sum(axis=0)
        usual = np.flatnonzero(wires == np.median(wires))
        if wires[span] <= np.median(wires) or not usual.size:
            return span
        return int(usual[np.argmin(np.abs(middles[usual] - middle))])

    @cached_property
    def span_at_rest(self) -> int:
        """The span along which the elasticity is known, counted from 0: one in the middle of the
        line outside overlaps."""
        at, masts = self.static("elasticity_x"), self.line("support_x")
        if not at.size:
            return self.reference_span
        return int(np.searchsorted(masts, 0.5 * (at[0] + at[-1]), side="right")) - 1


class TrainOfRun(LineOfRun):
    """Pantographs, strips and wires over them, in a result file that is open. Not collective."""

    def facts_of(self, name: str) -> np.ndarray:
        """A fact of each pantograph, (n_pantographs,), NaN as of ``Results.fact``."""
        return np.broadcast_to(self._file.facts[name], self.n_pantographs)

    @property
    def n_pantographs(self) -> int:
        """Number of pantographs."""
        return self._file.sizes["pantograph"]

    def n_strips(self) -> list[int]:
        """Number of strips of each pantograph, by their order."""
        recorded: list[int] = self._file.attrs["n_strips"]
        return recorded or [1] * self.n_pantographs

    @property
    def several_strips(self) -> bool:
        """Whether a pantograph has more than one strip."""
        return max(self.n_strips(), default=1) > 1

    def strip_columns(self) -> list[range]:
        """Columns of ``strip_force`` of each pantograph."""
        ends = np.cumsum([0, *self.n_strips()]).tolist()
        return [range(*pair) for pair in itertools.pairwise(ends)]

    def wire_columns(self) -> list[dict[str, int]]:
        """Column of ``contact_wire_force`` by the name of a contact wire, of each pantograph."""
        names = self.wires_of(Role.CONTACT)
        numbers = itertools.count()
        return [{name: next(numbers) for name in names} for _ in range(self.n_pantographs)]

    def contact_columns(self) -> list[dict[str, int]]:
        """Column of ``lateral_place`` by the name of a contact, of each pantograph: "strip 1
        contact_wire"; the strip is left out where there is one strip, the wire where one wire."""
        wires, found, numbers = self.wires_of(Role.CONTACT), [], itertools.count()
        for strips in self.strip_columns():
            words = [
                [*([f"strip {n + 1}"] if len(strips) > 1 else ()), *([w] if len(wires) > 1 else ())]
                for n in range(len(strips))
                for w in wires
            ]
            found.append({" ".join(own): next(numbers) for own in words})
        return found

    def pantograph_words(self) -> list[dict[str, Any]]:
        """Words about each pantograph, by their order: ``kind``, ``model``, ``description``; empty
        tables in files without."""
        recorded: list[dict[str, Any]] = self._file.attrs.get("pantographs", [])
        return recorded or [{} for _ in range(self.n_pantographs)]

    def pantograph_names(self) -> list[str]:
        """Names of the pantographs, by their order on the train."""
        n = self.n_pantographs
        if n == 1:
            return ["pantograph"]
        first = self.first_position if self._file.records.rows[0] else -np.arange(n, dtype=float)
        names = [""] * n
        for name, index in zip(places_on_train(n), np.argsort(-first, kind="stable"), strict=True):
            names[index] = name
        return names

    @property
    def first_position(self) -> np.ndarray:
        """Places of the pantographs in the first record, (n_pantographs,) [m]."""
        return np.asarray(self._file["channels/contact_position"][0])


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
        """A fact of ``postproc.files.facts``, NaN if the file was written without it.

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

        None where the file has no valid one: its run is not done, or records are damaged.
        """
        return filtered_in(self._file, (self._length, self.n_pantographs), index)

    def rows(self, name: str, part: slice) -> np.ndarray:
        """The rows ``part`` of channel ``name``, shape (rows, columns), NaN where it is damaged and
        where the line is not recorded."""
        columns, n_places = self.recorded_columns(name), self._n_places(name)
        part, table = self._within(name, part), self._table(name)
        valid = self._valid(name, part)
        if table is not None and columns.size == n_places and valid == part:
            return np.asarray(table[part])
        whole = np.full((part.stop - part.start, n_places), np.nan)
        if table is not None:
            whole[: valid.stop - valid.start, columns] = table[valid]
        return whole

    def column(self, name: str, index: int, part: slice | None = None) -> np.ndarray:
        """Column ``index`` of channel ``name``, all of its rows or ``part`` of them, from ``start``
        to ``stop``; NaN as in ``rows``."""
        part = self._within(name, part or slice(None))
        table, place = self._table(name), np.flatnonzero(self.recorded_columns(name) == index)
        values = np.full(part.stop - part.start, np.nan)
        if table is not None and place.size:
            valid = self._valid(name, part)
            values[: valid.stop - valid.start] = hdf5.column(table, valid, int(place[0]))
        return values

    def blocks(self, name: str) -> Iterator[tuple[slice, np.ndarray]]:
        """All rows of a channel in order, by blocks: which rows, and their values as ``rows``."""
        table = self._table(name)
        step = table.chunks[0] if table is not None and table.chunks else 1
        for part in hdf5.row_blocks(self.n_rows(name), self._n_places(name), step):
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
        valid = self._valid(name, slice(0, self.n_rows(name)))
        step = (table.chunks or (1,))[0]
        for first in range(0, numbers.size, hdf5.COLUMNS_AT_ONCE):
            columns = slice(first, min(first + hdf5.COLUMNS_AT_ONCE, numbers.size))
            for part in hdf5.row_blocks(valid.stop, columns.stop - first, step):
                if not hdf5.unwritten(table, part, columns):
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
        return hdf5.extremes(table, self._valid(name, slice(0, self.n_rows(name))).stop)

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

    def _within(self, name: str, part: slice) -> slice:
        """A part of the rows of a channel that can be read."""
        start, stop, _ = part.indices(self.n_rows(name))
        return slice(start, max(start, stop))

    def _valid(self, name: str, part: slice) -> slice:
        """The rows of a part, from ``start`` to ``stop``, before a damaged one of the channel."""
        n = self._file.records.damaged.get(self._path(name), part.stop)
        return slice(part.start, max(part.start, min(part.stop, n)))

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
