"""Reads the snapshots of ``fields.h5``, finished or not."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np

from catenary.postproc.files.checked import text_of
from catenary.postproc.read.guard import survives
from catenary.postproc.record.snapshots.blocks import OTHER_PARTS
from catenary.postproc.record.snapshots.fields_file import FORMAT, PLACES, SIZES
from catenary.solver.base.errors import InputError

FIELDS_FILE = "fields.h5"
# Snapshots that are looked through for the largest uplift.
_SAMPLED = 400


@dataclass(frozen=True)
class _Wire:
    """What snapshots show of a wire: nodes and places of its points, rows of each snapshot."""

    nodes: np.ndarray
    x: np.ndarray
    first: np.ndarray
    count: np.ndarray
    start: np.ndarray
    values: h5py.Dataset


class Snapshots:
    """Uplift of the nodes at the times of the snapshots. A context manager; not collective.

    Attributes
    ----------
    times : (n,) times of the snapshots that are there, ascending [s]
    parts : names of the wires and other parts of the line that are shown
    field : name of the field that lifts points, as ParaView's calculator has it
    whole : whether each snapshot shows all nodes

    Parameters
    ----------
    folder : of a run
    n_nodes : nodes of its line

    Raises
    ------
    InputError
        If the folder has no snapshots, or damaged ones, those of another line or without uplift.
    """

    def __init__(self, folder: Path, n_nodes: int) -> None:
        path = folder / FIELDS_FILE
        if not path.is_file():
            raise InputError(
                f"{path} does not exist: a film needs snapshots of the line; run the scene again "
                "with an output.field_every_s above 0"
            )
        if not survives(path):
            raise InputError(f"{path} is damaged: HDF5 does not read it")
        self._path, self._n_nodes = path, n_nodes
        self._file = h5py.File(path, "r")
        try:
            self._open()
        except BaseException:
            self._file.close()
            raise

    def _open(self) -> None:
        path, file = self._path, self._file
        if text_of(file.attrs.get("format")) != FORMAT and "uplift" in file:
            raise InputError(
                f"{path} was written by an earlier version of Catenary; run the scene again"
            )
        try:
            times = np.asarray(file["times"][...], dtype=float)
        except (KeyError, OSError, TypeError, ValueError) as error:
            raise InputError(f"{path} is damaged: it has no times of snapshots") from error
        n = int(np.append(np.isfinite(times), False).argmin()) if times.ndim == 1 else 0
        self.times = times[:n]
        if n < 2 or not (np.diff(self.times) > 0).all():
            raise InputError(f"{path} has fewer than two snapshots in order of time")
        try:
            self.parts = tuple(json.loads(text_of(file.attrs["parts"])))
            self._of_this_line = int(file.attrs["n_nodes"]) == self._n_nodes
            wires = [file[name] for name in self.parts if name not in OTHER_PARTS]
            if not all({"uplift", "displacement"} & set(wire) for wire in wires):
                raise InputError(
                    f"{path} has neither uplift nor displacement; run the scene again with one of "
                    "them in output.fields"
                )
            self._wires = [_wire(group) for group in wires]
            scalar = all("uplift" in wire for wire in wires)
            self.field = "uplift" if scalar else "displacement_Z"
            self._sizes = np.asarray(file[SIZES][...], dtype=int)
            if file[PLACES].shape != (times.size, self._sizes.size + int(self._sizes.sum())):
                raise ValueError(f"{PLACES} has another size")
        except (KeyError, OSError, TypeError, ValueError) as error:
            raise InputError(f"{path} is damaged: {error}") from error
        shown = sum(wire.count for wire in self._wires)
        self.whole = bool(np.all(shown == self._n_nodes))

    def __enter__(self) -> Snapshots:
        return self

    def __exit__(self, kind: object, error: object, trace: object) -> None:
        self._file.close()

    def shown(self, number: int) -> tuple[float, float]:
        """From and to of the wires in a snapshot, as far as each reaches [m]."""
        ends = [
            wire.x[[int(wire.first[number]), int(wire.first[number] + wire.count[number]) - 1]]
            for wire in self._wires
        ]
        low, high = np.array(ends).reshape(-1, 2).T
        return float(low.min(initial=np.inf)), float(high.max(initial=-np.inf))

    @property
    def n_pantographs(self) -> int:
        """Number of pantographs whose masses or bodies are known."""
        return int(self._sizes.size)

    def pantographs(self, number: int) -> list[tuple[float, np.ndarray]]:
        """Base, and masses or bodies, of each pantograph in a snapshot; see `mbs.interface`."""
        row = np.asarray(self._file[PLACES][number], dtype=float)
        if not np.isfinite(row).all():
            raise InputError(f"{self._path} is damaged at t = {self.times[number]:g} s")
        n = self._sizes.size
        places = np.split(row[n:], np.cumsum(self._sizes)[:-1]) if n else []
        return list(zip(row[:n].tolist(), places, strict=True))

    def need_whole(self, for_what: str) -> None:
        """Raise InputError unless each snapshot shows all nodes, as ``for_what`` needs."""
        if not self.whole:
            raise InputError(
                f"{self._path} shows a part of the line only, and {for_what} needs all of it; run "
                "the scene again without output.field_window_m, field_spans and field_parts"
            )

    def largest_uplift(self, numbers: np.ndarray) -> float:
        """Largest uplift in some snapshots, of many in so many of them that it is not far from
        that, and not zero [m]."""
        some = numbers[:: max(1, numbers.size // _SAMPLED)].tolist()
        return max(1e-4, *(float(np.nanmax(np.abs(self.uplift(number)))) for number in some))

    def uplift(self, number: int) -> np.ndarray:
        """Uplift of the nodes in a snapshot, NaN where it shows none, (n_nodes,) [m].

        Raises
        ------
        InputError
            If it is not of this line, or not finite.
        """
        uplift = np.full(self._n_nodes, np.nan)
        sound = self._of_this_line
        try:
            for wire in self._wires if sound else ():
                first, count = int(wire.first[number]), int(wire.count[number])
                rows = slice(int(wire.start[number]), int(wire.start[number]) + count)
                values = np.asarray(wire.values[rows], dtype=float)
                if values.ndim > 1:
                    values = values[:, 2]
                uplift[wire.nodes[first : first + count]] = values
                sound = sound and bool(np.isfinite(values).all())
        except (IndexError, KeyError, OSError, TypeError, ValueError) as error:
            raise InputError(
                f"{self._path} is damaged at t = {self.times[number]:g} s: {error}"
            ) from error
        if not sound:
            raise InputError(
                f"{self._path} does not belong to the run.h5 beside it, or is damaged at "
                f"t = {self.times[number]:g} s"
            )
        return uplift


def _wire(group: h5py.Group) -> _Wire:
    first, count = group["first"][...], group["count"][...]
    start = np.cumsum(count) - count
    values = group["uplift" if "uplift" in group else "displacement"]
    if values.shape[0] != int(count.sum()):
        raise ValueError(f"{values.name} is too short")
    return _Wire(group["nodes"][...], group["points"][:, 0], first, count, start, values)
