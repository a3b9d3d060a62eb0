"""The extremes of the line's channels in a result file: kept twice, written in turn.

Each of the two says for how many steps it holds. The one that holds for the rows that are whole is
never the one that is being written.
"""

from __future__ import annotations

from collections.abc import Mapping

import h5py
import numpy as np

from catenary.postproc.channels import channels
from catenary.postproc.files.checked import ARRAYS_SUM, seal_arrays, sum_of_arrays

GROUP, ROWS = "extremes", "rows"
_SLOTS = ("0", "1")


def store_extremes(file: h5py.File, n_rows: int, extremes: Mapping[str, np.ndarray]) -> None:
    """Store the extremes of the first ``n_rows`` steps in place of the older of the two kept.

    Parameters
    ----------
    extremes : name of a channel -> (2, columns), smallest and largest
    """
    group = file.require_group(GROUP)
    counts = [int(group[slot][ROWS][()]) if slot in group else -1 for slot in _SLOTS]
    place = group.require_group(_SLOTS[int(np.argmin(counts))])
    arrays = {**extremes, ROWS: np.array(n_rows, dtype=np.int64)}
    for name, values in arrays.items():
        if name in place:
            place[name][...] = values
        else:
            place[name] = values
    seal_arrays(place, arrays)


def drop_extremes(file: h5py.File, n_rows: int) -> None:
    """Forget extremes of more steps than a run that goes on after ``n_rows`` has shown."""
    for slot in file[GROUP].values():
        if slot[ROWS][()] > n_rows + 1:
            slot[ROWS][...] = 0


def extremes_at(file: h5py.File, n_rows: int) -> dict[str, np.ndarray] | None:
    """The extremes of the first ``n_rows`` steps by channel, (2, columns) each; None if not kept.

    Those of one step more serve as well: a run that goes on from a state shows it again. Those
    whose checksum is wrong count as not kept.
    """
    found = {int(slot[ROWS][()]): slot for slot in file.get(GROUP, {}).values()}
    slot = found.get(n_rows, found.get(n_rows + 1))
    if slot is None:
        return None
    arrays = {name: slot[name][...] for name in (*channels.LINE_CHANNELS, ROWS)}
    if slot.attrs.get(ARRAYS_SUM) != sum_of_arrays(arrays):
        return None
    del arrays[ROWS]
    return arrays
