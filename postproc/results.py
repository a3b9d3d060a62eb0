"""Reads a result file, finished or not. Everything after the run goes through this reader."""

from __future__ import annotations

import json
from functools import cached_property
from pathlib import Path
from types import TracebackType
from typing import Any

import h5py
import numpy as np

from catenary.postproc import channels
from catenary.postproc.record.checked import text_of
from catenary.postproc.result_file import DONE, FORMAT, RUNNING, complete_rows
from catenary.solver.errors import InputError

RESULT_FILE = "run.h5"
_JSON_ATTRIBUTES = (
    "incidents",
    "versions",
    "config",
    "effects_on",
    "effects_off",
    "phase_wall_s",
    "inner_iterations",
    "pantographs",
    "n_strips",
)


class Results:
    """A result file opened for reading. A context manager; not collective.

    All channels are cut to the rows that are whole, so that a file whose writer was killed reads
    like a shorter run.

    Parameters
    ----------
    path : the result file or the folder that holds it as ``run.h5``

    Raises
    ------
    InputError
        If there is no such file, or if it is not a result file of this program.
    """

    def __init__(self, path: Path | str) -> None:
        path = Path(path)
        self.path = path / RESULT_FILE if path.is_dir() else path
        if not self.path.is_file():
            raise InputError(f"{self.path} does not exist: name a result file or its folder")
        try:
            # Without a lock, so that a run that is still going on can be looked at.
            self._file = h5py.File(self.path, "r", locking=False)
        except OSError as error:
            raise InputError(f"{self.path} cannot be read as HDF5 ({error})") from error
        found = text_of(self._file.attrs.get("format"))
        if found != FORMAT:
            self._file.close()
            raise InputError(
                f'{self.path} is no result file of this program: its attribute "format" is '
                f"{found!r}, not {FORMAT!r}"
            )

    def __enter__(self) -> Results:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    # ---- what the run was -------------------------------------------------------------------

    @cached_property
    def attributes(self) -> dict[str, Any]:
        """Root attributes, lists and tables decoded, numbers as Python's."""
        decoded: dict[str, Any] = {}
        for name, value in self._file.attrs.items():
            if name in _JSON_ATTRIBUTES:
                decoded[name] = json.loads(value)
            else:
                decoded[name] = text_of(value)
        return decoded

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
        return float(self.attributes["dt_s"])

    @property
    def n_steps(self) -> int:
        """Steps recorded, without the initial state."""
        return max(self.time.size - 1, 0)

    @property
    def simulated(self) -> float:
        """Time between the first and the last record [s]."""
        return float(self.time[-1] - self.time[0]) if self.time.size else 0.0

    # ---- channels ---------------------------------------------------------------------------

    @cached_property
    def _length(self) -> int:
        lengths = [dataset.shape[0] for dataset in self._file["channels"].values()]
        return min(complete_rows(self._file)[0], *lengths)

    @cached_property
    def time(self) -> np.ndarray:
        """Times of the records, shape (n,) [s]."""
        return np.asarray(self._file["time"][: self._length])

    def channel(self, name: str) -> np.ndarray:
        """A channel of ``postproc.channels``, shape (n, columns), read anew at each call."""
        return np.asarray(self._file[f"channels/{name}"][: self._length])

    @property
    def n_pantographs(self) -> int:
        """Number of pantographs."""
        return int(self._file["channels/contact_force"].shape[1])

    def n_strips(self) -> list[int]:
        """Number of strips of each pantograph, by their order; one each in files without."""
        told: list[int] = self.attributes.get("n_strips", [])
        return told or [1] * self.n_pantographs

    def strip_forces(self) -> list[np.ndarray]:
        """Shares of the strips in the contact force of each pantograph, (n, its strips) each [N].

        Empty if no pantograph has more than one.
        """
        counts = self.n_strips()
        if max(counts, default=1) == 1:
            return []
        return np.split(self.channel(channels.STRIP_FORCE.name), np.cumsum(counts)[:-1], axis=1)

    def constraint_violations(self) -> np.ndarray | None:
        """Largest open joint of each pantograph at each record, (n, n_pantographs) [m].

        NaN where a pantograph has no joints in the time loop, None if none has.
        """
        name = channels.CONSTRAINT_VIOLATION.name
        return self.channel(name) if name in self._file["channels"] else None

    def largest_violations(self) -> list[float | None]:
        """The same over the whole run (n_pantographs,) [m], None without joints in the loop."""
        found = self.constraint_violations()
        if found is None or not len(found):
            return [None] * self.n_pantographs
        return [None if np.isnan(largest) else float(largest) for largest in found.max(axis=0)]

    def pantograph_facts(self) -> list[dict[str, Any]]:
        """What is told of each pantograph, by their order: ``kind``, ``model``, ``description``,
        ``static_force_N``, ``actuator_force_N``; empty tables in files without."""
        told: list[dict[str, Any]] = self.attributes.get("pantographs", [])
        return told or [{} for _ in range(self.n_pantographs)]

    def pantograph_names(self) -> list[str]:
        """How the pantographs are called, by their order on the train."""
        n = self.n_pantographs
        if n == 1:
            return ["pantograph"]
        position = self.channel("contact_position")
        first = position[0] if position.shape[0] else -np.arange(n, dtype=float)
        names = [""] * n
        for place, index in enumerate(np.argsort(-first, kind="stable")):
            middle = f"no. {place + 1}"
            names[index] = "leading" if place == 0 else "trailing" if place == n - 1 else middle
        return names

    def energies(self) -> dict[str, np.ndarray]:
        """Energies by name, each (m,), empty if the run did not record them."""
        if "energy" not in self._file:
            return {}
        group = self._file["energy"]
        lengths = [group[name].shape[0] for name in channels.ENERGIES]
        n = min(complete_rows(self._file)[1], *lengths)
        return {name: np.asarray(group[name][:n]) for name in channels.ENERGIES}

    # ---- constants --------------------------------------------------------------------------

    def line(self, name: str) -> np.ndarray:
        """A dataset of ``/line``, for instance ``support_x``."""
        return np.asarray(self._file[f"line/{name}"][...])

    def wires(self) -> dict[str, np.ndarray]:
        """Node numbers of each wire in order of x."""
        return {name: np.asarray(nodes[...]) for name, nodes in self._file["line/wires"].items()}

    def static(self, name: str) -> np.ndarray:
        """A dataset of ``/static``, for instance ``dropper_length``."""
        return np.asarray(self._file[f"static/{name}"][...])

    @cached_property
    def evaluation(self) -> tuple[float, float]:
        """From and to of the stretch whose statistics are judged [m]."""
        start, end = self.line("evaluation_range")
        return float(start), float(end)

    @cached_property
    def reference_span(self) -> int:
        """The span in the middle of the evaluation stretch, counted from 0, shown for all."""
        masts = self.line("support_x")
        middle = 0.5 * sum(self.evaluation)
        return int(np.clip(np.searchsorted(masts, middle, side="right") - 1, 0, masts.size - 2))

    @property
    def checkpoint(self) -> dict[str, Any]:
        """The latest state to continue from.

        Raises
        ------
        InputError
            If the file holds none.
        """
        group = self._file.get("checkpoint")
        if group is None or "latest" not in group.attrs:
            raise InputError(f"{self.path} holds no state to continue from")
        slot = group[text_of(group.attrs["latest"])]
        return {name: _value(dataset) for name, dataset in slot.items()}


def _value(dataset: h5py.Dataset) -> Any:
    value = dataset[()]
    return value.decode() if isinstance(value, bytes) else value
