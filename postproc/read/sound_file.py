"""A result file opened for reading, of which nothing is given out that is not sound."""

from __future__ import annotations

import contextlib
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from catenary.base.errors import InputError
from catenary.meshgen.wires import Role
from catenary.postproc.files.hdf5.checked import text_of
from catenary.postproc.files.kept_extremes import extremes_at
from catenary.postproc.files.result_file import COMPLETE, FORMAT
from catenary.postproc.read.attributes import HDF5_ERRORS, read_attributes
from catenary.postproc.read.checkpoint import read_slot, slots_of
from catenary.postproc.read.constants import constant_faults
from catenary.postproc.read.facts import facts_of_earlier, read_facts
from catenary.postproc.read.file_schema import (
    EARLIER_FORMATS,
    energy_tables,
    line_tables,
    step_tables,
)
from catenary.postproc.read.records import Records, scan, table_faults
from catenary.postproc.read.running_file import opened, opened_image
from catenary.postproc.read.tables import PartialTable

# More faults of one file than these are not listed.
_LISTED = 3


class SoundFile:
    """A result file whose attributes, constants and tables have been checked. Not collective.

    Reads like an ``h5py.File``: rows from the first damaged one of an essential table on are not
    there, damaged rows of other tables are NaN.

    Parameters
    ----------
    path : the result file
    records : what ``scan`` found in it, None to scan it when records are first read
    image : its bytes, if a run of this process wrote it; the file need not be there any more

    Attributes
    ----------
    attrs : sound root attributes, lists and tables decoded, numbers as Python's
    facts : name -> value of the facts, NaN for those that files of earlier formats do not have

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
                opened(path) if image is None else (opened_image(image), None)
            )
        except HDF5_ERRORS as error:
            reason = " ".join(str(error).split())
            raise InputError(
                f"{path} cannot be read as HDF5 ({reason}): it is damaged or no result file; "
                "nothing in it can be used"
            ) from error
        self._sizes: dict[str, int] = {}
        try:
            self._refuse_other_format()
            self.attrs, fatal, self._partial = read_attributes(self._file)
            self.facts, wrong = self._read_facts()
            faults, self._sizes = constant_faults(self._file)
            fatal += wrong
            self._faults = [] if fatal else table_faults(self._file, self.attrs, self._sizes)
            fatal += faults + [f"{f.path} {f.fault}" for f in self._faults if f.essential]
            fatal += [*self._strip_faults(), *self._wire_faults()] if not fatal else []
            if fatal:
                raise InputError(_refusal(path, fatal, self._usable()))
        except BaseException:
            self.close()
            raise
        if records is not None:
            self.records = records

    @cached_property
    def records(self) -> Records:
        """Which records are sound."""
        return scan(self._file, self.attrs, self._dt, self._faults, self._complete)

    @property
    def _dt(self) -> float:
        """Time between two records [s]."""
        return float(self.facts["time_step"])

    def _read_facts(self) -> tuple[dict[str, np.ndarray], list[str]]:
        """The facts, and what is wrong with them."""
        if self.of_earlier_format:
            return facts_of_earlier(self.attrs)
        return read_facts(self._file)

    @property
    def of_earlier_format(self) -> bool:
        """Whether an earlier version of the program wrote the file."""
        return self.attrs.get("format") in EARLIER_FORMATS

    @property
    def damage(self) -> list[str]:
        """A sentence that names the file's damage and what is used of it, none if it is sound."""
        damage = [*self._partial, *self.records.told]
        if not damage:
            return []
        return [f"{self.path.name} is damaged: {_listed(damage)}; {_up_to(self.records.last)}."]

    def state(self) -> tuple[dict[str, Any], list[str]]:
        """The latest sound state to continue from, and messages about later ones.

        Raises
        ------
        InputError
            If there is none.
        """
        told: list[str] = []
        for slot in slots_of(self._file):
            try:
                state = read_slot(self._file, slot, self.records.rows[0])
            except ValueError as error:
                told.append(f"the state in checkpoint/{slot} is damaged, {error}")
                continue
            if told:
                told = [f"{self.path}: {_listed(told)}; the one of step {state['step']} is taken"]
            return state, told
        if not told:
            raise InputError(f"{self.path} holds no state to continue from")
        raise InputError(
            f"{self.path} holds no sound state to continue from: {_listed(told)}; "
            f"{_up_to(self.records.last)} and can be reported; to go on, start the run anew"
        )

    def read_states(self) -> None:
        """Read all states and extremes once, sound or not."""
        for slot in slots_of(self._file):
            with contextlib.suppress(ValueError):
                read_slot(self._file, slot, self.records.rows[0])
        self.extremes(self.records.rows[0])

    def __contains__(self, path: str) -> bool:
        if path == "energy" and any(fault.path in energy_tables() for fault in self._faults):
            return False
        if path == COMPLETE or path in self.records.damaged:
            return True
        try:
            return path in self._file
        except HDF5_ERRORS:  # `records` reports it
            return False

    def __getitem__(self, path: str) -> Any:
        if path == COMPLETE:
            return np.array(self.records.rows)
        if path in self.records.damaged:
            return self._around(path)
        try:
            return self._file[path]
        except HDF5_ERRORS as error:
            raise InputError(f"{self.path} is damaged: {path} cannot be read") from error

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def _around(self, path: str) -> PartialTable:
        with_steps, apart = line_tables(self.attrs)
        columns = {**step_tables()[1], **with_steps, **apart}[path].columns
        n = self.records.rows[2 if path in apart else 0]
        shape = (n, self._sizes[columns]) if columns else (n,)
        unusable = any(fault.path == path for fault in self._faults)
        table = None if unusable else self._file[path]
        return PartialTable(table, shape, self.records.damaged[path])

    def extremes(self, n_rows: int) -> dict[str, np.ndarray] | None:
        """Extremes of the line's channels over the first ``n_rows`` steps by channel,
        (2, columns); None if they are not kept, or damaged."""
        try:
            return extremes_at(self._file, n_rows)
        except HDF5_ERRORS:
            return None

    def _refuse_other_format(self) -> None:
        try:
            found = text_of(self._file.attrs.get("format"))
        except HDF5_ERRORS as error:
            raise InputError(
                f"{self.path} is damaged: the head of the file cannot be read; nothing in it can "
                "be used"
            ) from error
        if not isinstance(found, str) or found not in (FORMAT, *EARLIER_FORMATS):
            raise InputError(
                f'{self.path} is no result file of this program: its attribute "format" is '
                f"{found!r}, not {FORMAT!r}"
            )

    def _strip_faults(self) -> list[str]:
        """What does not fit the number of pantographs."""
        n = self._sizes["P"]
        if n < 1:
            return ["channels/contact_force has no columns"]
        for name in ("n_strips", "pantographs"):
            if self.attrs[name] and len(self.attrs[name]) != n:
                return [f'its attribute "{name}" has {len(self.attrs[name])} entries for {n}']
        if not self.of_earlier_format and self.facts["static_force"].size != n:
            return [f"its facts are of {self.facts['static_force'].size} pantographs of {n}"]
        strips = sum(self.attrs["n_strips"] or [1] * n)
        path = "channels/strip_force"
        if strips > n and self._sizes.get("S") != strips:
            return [f"{path} does not have {strips} columns"]
        contacts = strips * len(self._contact_wires())
        if self._sizes.get("K", contacts) != contacts:
            return [f"channels/lateral_place does not have {contacts} columns"]
        return []

    def _contact_wires(self) -> list[str]:
        """Names of the contact wires."""
        roles = self.attrs["wires"]
        return [name for name, role in roles.items() if role == Role.CONTACT.value]

    def _wire_faults(self) -> list[str]:
        """What does not fit the wires and their roles."""
        nodes, roles = self._file["line/wires"], self.attrs["wires"]
        for name in roles:
            if name not in nodes:
                return [f"line/wires has no {name}, whose role is {roles[name]}"]
        contact = self._contact_wires()
        if not contact:
            return ["no wire has the role of a contact wire"]
        sizes = [nodes[name].size for name in contact]
        if sum(sizes) != self._sizes["C"]:
            return [f"static/contact_x has {self._sizes['C']} entries in place of {sum(sizes)}"]
        x = np.split(self._file["static/contact_x"][...], np.cumsum(sizes)[:-1])
        if not all(own.size > 1 and (np.diff(own) > 0.0).all() for own in x):
            return ["static/contact_x does not ascend"]
        if self._sizes.get("W", len(contact)) != len(contact):
            return [f"static/elasticity_of_wires is of {self._sizes['W']} wires of {len(contact)}"]
        shares = self._sizes["P"] * len(contact)
        if self._sizes.get("F", shares) != shares:
            return [f"channels/contact_wire_force does not have {shares} columns"]
        tensions = np.size(self.facts["contact_wire_tension"])
        if tensions != len(contact):
            return [f"its facts are of {tensions} contact wires of {len(contact)}"]
        return []

    def _usable(self) -> str:
        """What can still be used of a file of which no report can be made."""
        step = np.asarray(self.facts.get("time_step", np.nan))
        dt = float(step) if step.ndim == 0 and step.dtype.kind in "fiu" else np.nan
        if any(f.essential for f in self._faults) or not dt > 0.0:
            return "no part of it can be reported"
        about = {"n_steps": None, "outcome": "running", **self.attrs}
        last = scan(self._file, about, dt, self._faults, self._complete).last
        return f"{_up_to(last)} and can be read with h5py"


def _refusal(path: Path, faults: list[str], usable: str) -> str:
    return f"{path} is damaged: {_listed(faults)}; {usable}"


def _listed(faults: list[str]) -> str:
    more = len(faults) - _LISTED
    return "; ".join(faults[:_LISTED]) + (f"; and {more} more faults" if more > 0 else "")


def _up_to(last: float) -> str:
    if last != last:
        return "none of its records can be read"
    return f"its records up to t = {last:.3f} s are sound"
