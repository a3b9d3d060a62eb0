"""The extremes of the line's channels in a result file: kept twice, written in turn.

Each of the two says for how many steps it holds. The one that holds for the rows that are whole is
never the one that is being written.
"""

from __future__ import annotations

from collections.abc import Mapping

import h5py
import numpy as np

from catenary.postproc.files.dimensions import describe_extremes
from catenary.postproc.files.hdf5.checked import put_array, seal_arrays, sum_is_kept

GROUP, ROWS = "extremes", "rows"
_SLOTS = ("0", "1")


def store_extremes(file: h5py.File, n_rows: int, extremes: Mapping[str, np.ndarray]) -> None:
    """Store the extremes of the first ``n_rows`` steps in place of the older of the two kept.

    Parameters
    ----------
    file : h5py.File
        Result file, open for writing.
    n_rows : int
        Number of steps that the extremes cover.
    extremes : mapping
        Smallest and largest values, (2, columns), by channel.
    """
    group = file.require_group(GROUP)
    counts = [_rows_of(group[slot]) if slot in group else -1 for slot in _SLOTS]
    place = group.require_group(_SLOTS[int(np.argmin(counts))])
    arrays = {**extremes, ROWS: np.array(n_rows, dtype=np.int64)}
    for name, values in arrays.items():
        is_new = name not in place
        table = put_array(place, name, values)
        if is_new and name != ROWS:
            describe_extremes(file, table, name)
    seal_arrays(place, arrays)


def drop_extremes(file: h5py.File, n_rows: int) -> None:
    """Forget extremes of more steps than a run that goes on after ``n_rows`` has shown."""
    for slot in file[GROUP].values():
        if _rows_of(slot) > n_rows + 1:
            slot[ROWS][...] = -1


def extremes_at(file: h5py.File, n_rows: int) -> dict[str, np.ndarray] | None:
    """The extremes of the first ``n_rows`` steps by channel, (2, columns) each; None if not kept.

    Those of one step more serve as well: a run that goes on from a state shows it again. Those
    whose checksum is wrong count as not kept.
    """
    found = {_rows_of(slot): slot for slot in file.get(GROUP, {}).values()}
    slot = found.get(n_rows, found.get(n_rows + 1))
    if slot is None:
        return None
    arrays = {name: values[...] for name, values in slot.items()}
    if not sum_is_kept(slot, arrays):
        return None
    del arrays[ROWS]
    return arrays


def _rows_of(slot: h5py.Group) -> int:
    """For how many steps a slot holds, -1 if that is not a single whole number."""
    rows = slot.get(ROWS)
    if not isinstance(rows, h5py.Dataset) or rows.shape != () or rows.dtype.kind not in "iu":
        return -1
    return int(rows[()])
