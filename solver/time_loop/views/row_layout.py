"""The row that a step shows: the values of all channels one after another.

First stands what pantographs keep in one array, then arms and droppers: a step fills these parts as
a whole. What other channels take from arrays elsewhere is copied behind them, number by number.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from catenary.solver.time_loop.views.channels import CHANNELS, Sources


class RowLayout:
    """Layout of a row: part of each channel, and its source. Not collective.

    Attributes
    ----------
    columns : name of a channel -> its part of a row
    width : numbers of a row
    copied : arrays (n,) that stand behind the first numbers, one after another
    in_loop : whether copies fill a row; not if a channel is a function

    Parameters
    ----------
    sources : of the channels, of which ``arm_uplift`` and ``dropper_force`` are parts of ``shown``
    shown : (n,) what pantographs, arms and droppers show

    Raises
    ------
    ValueError
        If the values of a channel are no contiguous doubles.
    """

    def __init__(self, sources: Sources, shown: np.ndarray) -> None:
        self.columns: dict[str, slice] = {}
        self._copied: list[tuple[slice, np.ndarray]] = []
        self._called: list[tuple[slice, Callable[[], np.ndarray]]] = []
        self.width = shown.size
        self.copied: list[np.ndarray] = []
        for channel in CHANNELS.values():
            assert channel.values is not None
            values = channel.values(sources)
            array = values if isinstance(values, np.ndarray) else np.asarray(values())
            part = _part_of(shown, sources, array)
            if part is None:
                part = slice(self.width, self.width + array.size)
                self.width = part.stop
                if isinstance(values, np.ndarray):
                    if array.dtype != np.float64 or not array.flags.c_contiguous:
                        raise ValueError(
                            f"the values of channel {channel.name} are no contiguous doubles"
                        )
                    self.copied.append(array.reshape(-1))
                    self._copied.append((part, array))
                else:
                    self._called.append((part, values))
            self.columns[channel.name] = part
        self.in_loop = not self._called

    def fill(self, row: np.ndarray) -> None:
        """Fill in what stands behind the first numbers of a row."""
        for part, array in self._copied:
            row[part] = array
        for part, values in self._called:
            row[part] = values()


def _part_of(shown: np.ndarray, sources: Sources, array: np.ndarray) -> slice | None:
    """Place of an array in the row that a step shows, None if it is not a part of it."""
    for whole in (shown, sources.pantographs.outputs):
        begin = array.ctypes.data - whole.ctypes.data
        if 0 <= begin and begin + array.nbytes <= whole.nbytes and array.flags.c_contiguous:
            return slice(begin // 8, begin // 8 + array.size)
    return None
