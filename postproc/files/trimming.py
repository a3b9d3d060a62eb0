"""Gives back the room that was claimed behind the end of a result file."""

from __future__ import annotations

import contextlib
import os
import struct
from collections.abc import Iterator

import h5py

_SIGNATURE = b"\x89HDF\r\n\x1a\n"
# Where a superblock of each version keeps the end of what the file holds [bytes].
_END_AT = {0: 40, 1: 44, 2: 28, 3: 28}


@contextlib.contextmanager
def trimmed(file: h5py.File) -> Iterator[None]:
    """Cut an open file, which is closed inside, to what it holds. A context manager.

    HDF5 itself gives back only what it has claimed; its file stays as it is if its head is not of
    a known kind.
    """
    handle = os.dup(file.id.get_vfd_handle())
    try:
        yield
        end = _end(os.pread(handle, 64, 0))
        if end is not None and 0 < end < os.fstat(handle).st_size:
            os.ftruncate(handle, end)
    finally:
        os.close(handle)


def _end(head: bytes) -> int | None:
    """The end of a file by the first bytes of it; None if its superblock is not understood."""
    if not head.startswith(_SIGNATURE) or head[8] not in _END_AT:
        return None
    version = head[8]
    width = head[13] if version < 2 else head[9]
    if width != 8:
        return None
    (end,) = struct.unpack_from("<Q", head, _END_AT[version])
    return int(end)
