"""The train of a result file: pantographs in running order, their strips, their columns."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np

from catenary.meshgen.wires import Role
from catenary.postproc.channels.places_on_train import places_on_train
from catenary.postproc.read.line_of_run import LineOfRun


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
