"""Results of a march to its end whose histories are in memory: a result file that was never
written."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from catenary.postproc.channels.header import Header
from catenary.postproc.channels.line_record import LineRecord
from catenary.postproc.files.run_schema import DONE
from catenary.postproc.read.records import Records


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
