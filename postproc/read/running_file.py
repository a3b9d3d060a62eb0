"""Opens a result file that its run may still be writing. Not collective.

HDF5 reads the index of a table, where its chunks lie, when a chunk is first wanted. In the file of
a run that goes on the index then is newer than the end of the file that was found at opening, and
HDF5 refuses what lies behind it. So all indices are read at opening, and stay in HDF5's cache.
"""

from __future__ import annotations

import time
from pathlib import Path

import h5py
from h5py import h5f

from catenary.postproc.files.hdf5.checked import HDF5_ERRORS, text_of
from catenary.postproc.files.hdf5.self_contained import open_own
from catenary.postproc.files.result_file import committed_rows
from catenary.postproc.files.run_schema import RUNNING

# How often a file is opened that was written meanwhile, and the pause before [s]: an append takes
# some milliseconds.
_ATTEMPTS, _PAUSE = 20, 0.02

# Room for the indices [B]: those of a million chunks take half of it.
_CACHE = 128 << 20

Complete = tuple[list[int], str]


def opened(path: Path) -> tuple[h5py.File, Complete | None]:
    """A result file, without a lock, so that a run can be read while it goes on.

    Returns
    -------
    file : with all indices read if its run goes on or was killed
    complete : result of ``committed_rows`` before that, so that no later record counts; None if
        the run has ended

    Raises
    ------
    InputError
        If it is no regular file, or its tables lie in other files.
    OSError, RuntimeError
        If HDF5 does not open it.
    """
    for attempt in range(_ATTEMPTS):
        file = open_own(path, locking=False)
        try:
            outcome = text_of(file.attrs.get("outcome"))
            if not isinstance(outcome, str) or outcome != RUNNING:
                return file, None
            complete = committed_rows(file)
            if not complete[1]:
                _read_indices(file)
                return file, complete
        except HDF5_ERRORS:
            pass
        if attempt < _ATTEMPTS - 1:
            file.close()
            time.sleep(_PAUSE)
    return file, None


def opened_image(image: bytes) -> h5py.File:
    """A result file that was read into memory, of a run of this program that has ended."""
    return h5py.File(h5f.open_file_image(image))


def _read_indices(file: h5py.File) -> None:
    """Read where the chunks of all tables lie, into a cache that has room for it."""
    cache = file.id.get_mdc_config()
    cache.set_initial_size, cache.initial_size, cache.max_size = True, _CACHE, _CACHE
    cache.decr_mode = 0
    file.id.set_mdc_config(cache)

    def read(name: str, item: object) -> None:
        if isinstance(item, h5py.Dataset) and item.chunks is not None:
            item.id.get_num_chunks()

    file.visititems(read)
