"""Tables of a run that `Results` reads: of a result file, or of a march in memory that wrote none.

A file is checked against ``run_schema`` before anything is given out. HDF5 reads the index of a
table, where its chunks lie, when a chunk is first wanted. In the file of a run that goes on the
index then is newer than the end of the file that was found at opening, and HDF5 refuses what lies
behind it. So all indices are read at opening, and stay in HDF5's cache.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from h5py import h5f

from catenary.base.errors import InputError
from catenary.meshgen.wires import Role
from catenary.postproc.files.committed_rows import committed_rows, extremes_at
from catenary.postproc.files.facts import NONE
from catenary.postproc.files.hdf5 import HDF5_ERRORS, Damage, open_own, sum_is_kept, text_of
from catenary.postproc.files.header import Header, LineRecord
from catenary.postproc.files.run_schema import (
    ALL_COLUMNS,
    DONE,
    FORMAT,
    RUNNING,
    RunAttributes,
    constant_tables,
    fact_tables,
)
from catenary.postproc.read.validation import (
    Records,
    check_tables,
    check_values,
    is_there,
    listed,
    names_in,
    read_attributes,
    scan,
    table_values,
    valid_until,
)
from catenary.solver.time_loop.views import channels

# Trials to open a file that is written meanwhile, and the pause before each [s]: an append takes
# some milliseconds.
_ATTEMPTS, _PAUSE = 20, 0.02

# Room for the indices [B]: those of a million chunks take half of it.
_CACHE = 128 << 20

Complete = tuple[list[int], str]
# Facts without which there is no report; others may have been declared after a file was written.
_ESSENTIAL_FACTS = ("time_step", "speed", "wave_speed")


def opened(path: Path) -> tuple[h5py.File, Complete | None]:
    """A result file, without a lock, so that a run can be read while it goes on.

    Returns
    -------
    file : with all indices read if its run goes on or was killed
    complete : result of ``committed_rows`` before that, so that no later record counts; None if
        the run has ended

    Raises
    ------
    InputError
        If it is no regular file, or its tables lie in other files.
    OSError, RuntimeError
        If HDF5 does not open it.
    """
    for attempt in range(_ATTEMPTS):
        file = open_own(path, locking=False)
        try:
            outcome = text_of(file.attrs.get("outcome"))
            if not isinstance(outcome, str) or outcome != RUNNING:
                return file, None
            complete = committed_rows(file)
            if not complete[1]:
                _read_indices(file)
                return file, complete
        except HDF5_ERRORS:
            pass
        if attempt < _ATTEMPTS - 1:
            file.close()
            time.sleep(_PAUSE)
    return file, None


def _read_indices(file: h5py.File) -> None:
    """Read where the chunks of all tables lie, into a cache that has room for it."""
    cache = file.id.get_mdc_config()
    cache.set_initial_size, cache.initial_size, cache.max_size = True, _CACHE, _CACHE
    cache.decr_mode = 0
    file.id.set_mdc_config(cache)

    def read(name: str, item: object) -> None:
        if isinstance(item, h5py.Dataset) and item.chunks is not None:
            item.id.get_num_chunks()

    file.visititems(read)


class ValidatedFile:
    """A result file whose attributes, constants and tables have been checked. Not collective.

    Parameters
    ----------
    path : the result file
    records : result of ``scan``, None to scan it when records are first read
    image : its bytes, if a run of this process wrote it; the file need not be there any more

    Attributes
    ----------
    attrs : valid root attributes, lists and tables decoded, numbers as Python's
    facts : name -> value of the facts, NaN for those declared after the file was written
    record : which of the line's channels are recorded
    sizes : of dimensions by name

    Raises
    ------
    InputError
        If it is no result file, or damaged so that no report can be made of it.
    """

    def __init__(
        self, path: Path, records: Records | None = None, image: bytes | None = None
    ) -> None:
        self.path = path
        try:
            self._file, self._complete = (
                opened(path) if image is None else (h5py.File(h5f.open_file_image(image)), None)
            )
        except HDF5_ERRORS as error:
            reason = " ".join(str(error).split())
            raise InputError(
                f"{path} cannot be read as HDF5 ({reason}): it is damaged or no result file; "
                "nothing in it can be used"
            ) from error
        try:
            self._check()
        except BaseException:
            self.close()
            raise
        if records is not None:
            self.records = records

    def _check(self) -> None:
        self._refuse_other_format()
        self.sizes: dict[str, int] = {}
        self.facts: dict[str, np.ndarray] = {}
        try:
            self.attrs, self._faults = read_attributes(self._file, RunAttributes)
            if not (self.attrs.get("rules") or self.attrs.get("edition")):
                raise Damage('its attribute "rules" is missing')
            known = self.attrs.get("line_record")
            self.record = LineRecord.model_validate(known or {})
            self._read_facts()
            self._check_constants()
            check_tables(self._file, self.record, self.sizes, self.attrs["n_steps_planned"] + 1)
            self._check_fit()
        except Damage as error:
            last = valid_until(self._file, self._complete)
            usable = f"{_up_to(last)} and can be read with h5py; " if last == last else ""
            what = "for a report run the case again" if usable else "run the case again"
            raise InputError(f"{self.path} is damaged: {error}; {usable}{what}") from error

    def _refuse_other_format(self) -> None:
        try:
            found = text_of(self._file.attrs.get("format"))
        except HDF5_ERRORS as error:
            raise InputError(
                f"{self.path} is damaged: the head of the file cannot be read; nothing in it can "
                "be used"
            ) from error
        if not isinstance(found, str) or found != FORMAT:
            raise InputError(
                f'{self.path} is no result file of this version of Catenary: its attribute "format"'
                f" is {found!r}, not {FORMAT!r}"
            )

    def _read_facts(self) -> None:
        try:
            group = self._file["facts"]
            read = {name: np.asarray(group[name][()]) for name in group}
            intact = sum_is_kept(group, read)
        except HDF5_ERRORS as error:
            raise Damage("its facts are missing or cannot be read") from error
        if intact is False:
            raise Damage("its facts differ from their checksum")
        for path, declared in fact_tables().items():
            name = path.removeprefix("facts/")
            if name in read:
                check_values(path, read[name], declared, self.sizes)
                self.facts[name] = read[name]
            elif intact and name not in _ESSENTIAL_FACTS:
                shape = tuple(self.sizes.get(own, 1) for own in declared.dimensions)
                self.facts[name] = np.full(shape, NONE)
            else:
                raise Damage(f"{path} is missing or cannot be read")

    def _check_constants(self) -> None:
        """Check the tables that are written once, and what numbers in them refer to."""
        file, largest = self._file, dict[str, int]()
        wires, breaks = names_in(file, "line/wires"), names_in(file, "line/breaks")
        if not wires:
            raise Damage("line/wires has no wire")
        for path, declared in constant_tables(wires, breaks).items():
            if declared.optional and not is_there(file, path):
                continue
            values = table_values(file, path, declared, self.sizes)
            if declared.whole and values.size:
                largest[path] = int(values.max())
        for path, limit in self._limits(wires).items():
            if largest.get(path, -1) >= limit:
                raise Damage(f"{path} names number {largest[path]} of {limit}")
        x = file["static/contact_x"][...]
        start, end = file["line/evaluation_range"][...]
        if start >= x.max() or end <= x.min():
            raise Damage("line/evaluation_range lies beyond the contact wires")

    def _limits(self, wires: list[str]) -> dict[str, int]:
        """How many nodes, wires, spans and columns there are for the numbers in each table."""
        sizes = self.sizes
        limits = {
            "line/droppers": sizes["node"],
            "line/dropper_span": sizes["support"] - 1,
            "line/arm_wire": len(wires),
            "line/end_wire": len(wires),
        }
        for name in wires:
            limits[f"line/wires/{name}"] = sizes["node"]
            limits[f"line/breaks/{name}"] = sizes[f"wires_{name}"]
        for name in channels.line_channels():
            of_all = ALL_COLUMNS[channels.CHANNELS[name].per]
            limits[f"line_columns/{name}"] = sizes.get(of_all, 0)
        return limits

    def _check_fit(self) -> None:
        """Check that sizes of tables fit the numbers of pantographs, strips and wires."""
        sizes, n = self.sizes, self.sizes["pantograph"]
        if n < 1:
            raise Damage("channels/contact_force has no columns")
        for name in ("n_strips", "pantographs"):
            if self.attrs[name] and len(self.attrs[name]) != n:
                raise Damage(f'its attribute "{name}" has {len(self.attrs[name])} entries for {n}')
        nodes, roles = self._file["line/wires"], self.attrs["wires"]
        for name, role in roles.items():
            if name not in nodes:
                raise Damage(f"line/wires has no {name}, whose role is {role}")
        contact = [name for name, role in roles.items() if role == Role.CONTACT.value]
        if not contact:
            raise Damage("no wire has the role of a contact wire")
        n_nodes = [nodes[name].size for name in contact]
        strips = sum(self.attrs["n_strips"] or [1] * n)
        expected = {
            "contact_node": sum(n_nodes),
            "contact_wire": len(contact),
            "strip": strips,
            "contact": strips * len(contact),
            "contact_wire_of_pantograph": n * len(contact),
        }
        for name, size in expected.items():
            if sizes.get(name, size) != size:
                raise Damage(f"its tables have {sizes[name]} of {name} in place of {size}")
        if strips > n and "strip" not in sizes:
            raise Damage("channels/strip_force is missing")
        x = np.split(self._file["static/contact_x"][...], np.cumsum(n_nodes)[:-1])
        if not all(own.size > 1 and (np.diff(own) > 0.0).all() for own in x):
            raise Damage("static/contact_x does not ascend")

    @cached_property
    def records(self) -> Records:
        """Valid records of the file."""
        dt = float(self.facts["time_step"])
        return scan(self._file, self.attrs, self.record, dt, self._complete)

    @property
    def damage(self) -> list[str]:
        """A sentence that names the file's damage and what is used of it, none if it is valid."""
        faults = [*self._faults, *self.records.faults]
        if not faults:
            return []
        return [f"{self.path.name} is damaged: {listed(faults)}; {_up_to(self.records.last)}."]

    def __contains__(self, path: str) -> bool:
        return is_there(self._file, path)

    def __getitem__(self, path: str) -> Any:
        try:
            return self._file[path]
        except HDF5_ERRORS as error:
            raise InputError(f"{self.path} is damaged: {path} cannot be read") from error

    @property
    def has_energies(self) -> bool:
        """Whether the energies were recorded."""
        return "energy" in self

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def image(self) -> bytes:
        """The bytes of the file."""
        return bytes(self._file.id.get_file_image())

    # ---- kept twice ----------------------------------------------------------------------------

    def extremes(self, n_rows: int) -> dict[str, np.ndarray] | None:
        """Extremes of the line's channels over the first ``n_rows`` steps by channel,
        (2, columns); None if they are not kept, or damaged."""
        try:
            return extremes_at(self._file, n_rows)
        except HDF5_ERRORS:
            return None

    def state(self) -> tuple[dict[str, Any], list[str]]:
        """The latest valid state to continue from, and messages about later ones.

        Raises
        ------
        InputError
            If there is none.
        """
        faults: list[str] = []
        for slot in self._slots():
            try:
                state = _state_in(self._file, slot, self.records.rows[0])
            except Damage as error:
                faults.append(f"the state in checkpoint/{slot} is damaged, {error}")
                continue
            if faults:
                taken = f"the one of step {state['step']} is taken"
                faults = [f"{self.path}: {listed(faults)}; {taken}"]
            return state, faults
        if not faults:
            raise InputError(f"{self.path} holds no state to continue from")
        raise InputError(
            f"{self.path} holds no valid state to continue from: {listed(faults)}; "
            f"{_up_to(self.records.last)} and can be reported; to go on, start the run anew"
        )

    def read_states(self) -> None:
        """Read all states and extremes once, valid or not."""
        for slot in self._slots():
            with contextlib.suppress(Damage):
                _state_in(self._file, slot, self.records.rows[0])
        self.extremes(self.records.rows[0])

    def _slots(self) -> list[str]:
        """Names of the states, the latest first; empty if there are none."""
        try:
            latest = text_of(self._file["checkpoint"].attrs["latest"])
        except HDF5_ERRORS:
            latest = ""
        return sorted(names_in(self._file, "checkpoint"), key=lambda name: (name != latest, name))


def _state_in(file: h5py.File, slot: str, n_rows: int) -> dict[str, Any]:
    """The state in a slot, which ``n_rows`` valid steps precede; `Damage` with a clause on its
    fault."""
    try:
        group = file[f"checkpoint/{slot}"]
        state = {name: text_of(dataset[()]) for name, dataset in group.items()}
        intact = sum_is_kept(group, state) is not False
    except HDF5_ERRORS as error:
        raise Damage("it cannot be read") from error
    if not intact:
        raise Damage("it differs from its checksum")
    for name, values in state.items():
        if isinstance(values, (float, np.ndarray)) and not np.isfinite(values).all():
            raise Damage(f"{name} holds NaN or infinity")
    step = state.get("step")
    if not isinstance(step, int) or isinstance(step, bool) or step < 0:
        raise Damage("it has no step")
    if step > n_rows:
        raise Damage(f"it is of step {step}, and the records before it end after {n_rows}")
    return state


def _up_to(last: float) -> str:
    if last != last:
        return "none of its records can be read"
    return f"its records up to t = {last:.3f} s are valid"


class _Table:
    """An array that is read as a dataset of HDF5."""

    chunks = None

    def __init__(self, values: np.ndarray, attrs: Mapping[str, Any]) -> None:
        self._values, self.attrs = values, attrs
        self.shape, self.dtype = values.shape, values.dtype

    def __getitem__(self, part: Any) -> np.ndarray:
        return np.asarray(self._values[part])

    def read_direct(self, destination: np.ndarray, part: Any) -> None:
        """Copy some numbers."""
        destination[...] = self._values[part]


class MarchedFile:
    """Tables of a march to its end in memory, which `Results` reads. Not collective.

    Parameters
    ----------
    header : of the run
    tables : path in a result file -> array of what grows with the steps, ``time`` among them
    extremes : channel of the line -> smallest and largest values over all steps, (2, columns)
    about : path -> attributes of a table that has some
    """

    def __init__(
        self,
        header: Header,
        tables: Mapping[str, np.ndarray],
        extremes: Mapping[str, np.ndarray],
        about: Mapping[str, Mapping[str, Any]],
    ) -> None:
        self._tables = {
            path: _Table(values, about.get(path, {}))
            for path, values in {**header.datasets, **tables}.items()
        }
        self._extremes = dict(extremes)
        self.attrs = {"n_ranks": 1, **header.attributes, "outcome": DONE}
        self.facts = dict(header.facts)
        self.damage: list[str] = []
        self.has_energies = False
        n = len(tables["time"])
        self.records = Records([n, 0, n], {}, [], float(tables["time"][-1]) if n else float("nan"))
        self.record = LineRecord()
        n_pantographs = tables["channels/contact_force"].shape[1]
        self.attrs.setdefault("n_strips", [1] * n_pantographs)
        self.sizes = {"pantograph": n_pantographs}

    def __contains__(self, path: str) -> bool:
        return path in self._tables

    def __getitem__(self, path: str) -> Any:
        if path in self._tables:
            return self._tables[path]
        below = f"{path}/"
        found = {
            name.removeprefix(below): t
            for name, t in self._tables.items()
            if name.startswith(below)
        }
        if not found:
            raise KeyError(path)
        return found

    def extremes(self, _: int) -> dict[str, np.ndarray]:
        """Extremes of the line's channels."""
        return self._extremes

    def close(self) -> None:
        """Do nothing: no file is open."""
