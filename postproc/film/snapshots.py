"""Reads the snapshots of ``fields.h5``, finished or not."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np

from catenary.postproc.read.guard import survives
from catenary.postproc.record.growing_xdmf import snapshot_name
from catenary.solver.base.errors import InputError

FIELDS_FILE = "fields.h5"
# Snapshots that are looked through for the largest uplift.
_SAMPLED = 400


class Snapshots:
    """Uplift of all nodes at the times of the snapshots. A context manager; not collective.

    Attributes
    ----------
    times : (n,) times of the snapshots that are there, ascending [s]

    Parameters
    ----------
    folder : of a run
    n_nodes : nodes of its line

    Raises
    ------
    InputError
        If the folder has no snapshots, or damaged ones, or those of another line.
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
            times = np.asarray(self._file["times"][...], dtype=float)
        except (KeyError, OSError, TypeError, ValueError) as error:
            self._file.close()
            raise InputError(f"{path} is damaged: it has no times of snapshots") from error
        n = int(np.append(np.isfinite(times), False).argmin()) if times.ndim == 1 else 0
        self.times = times[:n]
        if n < 2 or not (np.diff(self.times) > 0).all():
            self._file.close()
            raise InputError(f"{path} has fewer than two snapshots in order of time")

    def __enter__(self) -> Snapshots:
        return self

    def __exit__(self, kind: object, error: object, trace: object) -> None:
        self._file.close()

    def largest_uplift(self, numbers: np.ndarray) -> float:
        """Largest uplift in some snapshots, of many in so many of them that it is not far from
        that, and not zero [m]."""
        some = numbers[:: max(1, numbers.size // _SAMPLED)].tolist()
        return max(1e-4, *(float(np.abs(self.uplift(number)).max()) for number in some))

    def uplift(self, number: int) -> np.ndarray:
        """Uplift of the nodes in a snapshot, (n_nodes,) [m].

        Raises
        ------
        InputError
            If it is not of this line, or not finite.
        """
        try:
            values = np.asarray(self._file[f"uplift/{snapshot_name(number)}"][...], dtype=float)
        except (KeyError, OSError, TypeError, ValueError) as error:
            raise InputError(
                f"{self._path} is damaged at t = {self.times[number]:g} s: {error}"
            ) from error
        if values.shape != (self._n_nodes,) or not np.isfinite(values).all():
            raise InputError(
                f"{self._path} does not belong to the run.h5 beside it, or is damaged at "
                f"t = {self.times[number]:g} s"
            )
        return values
