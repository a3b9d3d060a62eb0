"""The state to continue from, taken from the slot that is sound. Not collective."""

from __future__ import annotations

from typing import Any

import h5py
import numpy as np

from catenary.postproc.files.hdf5.checked import sum_is_kept, text_of
from catenary.postproc.read.attributes import HDF5_ERRORS


def slots_of(file: h5py.File) -> list[str]:
    """Names of the states in a file, the latest first; empty if there are none."""
    try:
        group = file["checkpoint"]
        names = sorted(group)
    except HDF5_ERRORS:
        return []
    try:
        latest = text_of(group.attrs["latest"])
    except HDF5_ERRORS:
        latest = ""
    return sorted(names, key=lambda name: name != latest)


def read_slot(file: h5py.File, slot: str, n_rows: int) -> dict[str, Any]:
    """A state by name.

    Parameters
    ----------
    n_rows : sound records of the file, which the state must follow

    Raises
    ------
    ValueError
        If it is damaged; the message is a clause that says in what.
    """
    try:
        group = file[f"checkpoint/{slot}"]
        state = {name: text_of(dataset[()]) for name, dataset in group.items()}
        same = sum_is_kept(group, state) is not False
    except HDF5_ERRORS as error:
        raise ValueError("it cannot be read") from error
    if not same:
        raise ValueError("it differs from its checksum")
    for name, values in state.items():
        if isinstance(values, (float, np.ndarray)) and not np.isfinite(values).all():
            raise ValueError(f"{name} holds NaN or infinity")
    step = state.get("step")
    if not isinstance(step, int) or isinstance(step, bool) or step < 0:
        raise ValueError("it has no step")
    if step > n_rows:
        raise ValueError(f"it is of step {step}, and the records before it end after {n_rows}")
    return state
