"""Writing result files: attributes, room on the disk, files that appear whole or not at all."""

from __future__ import annotations

import contextlib
import errno
import json
import math
import os
import struct
from collections.abc import Iterator, Mapping
from pathlib import Path
from shlex import quote
from typing import Any

import h5py
import numpy as np

from catenary.base.errors import RunBroken
from catenary.base.files import appears_whole
from catenary.postproc.files.disk_errors import code_of, reason, remedy
from catenary.postproc.files.hdf5 import FORMAT_BOUNDS, open_own

# Errors of flock on a file system without locks.
_NO_LOCKS = (errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP)
# Room for HDF5's own tables and for the last words of a run that has filled the disk [bytes].
MARGIN = 128 * 1024
_SIGNATURE = b"\x89HDF\r\n\x1a\n"
# Offset at which a superblock has the end of the file's content, of the versions of `FORMAT_BOUNDS`
# [bytes].
_END_AT, _VERSIONS = 28, (2, 3)


def plain(value: Any) -> Any:
    """``value`` in types of JSON: NumPy types converted, NaN and infinity as None, zero without a
    sign."""
    # The most frequent types come first.
    if value is None or isinstance(value, (str, int)):
        return value
    if isinstance(value, float):
        return float(value) + 0.0 if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if isinstance(value, (set, frozenset)):
        return [plain(item) for item in sorted(value)]
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, np.generic):
        return plain(value.item())
    return str(value)


def as_attribute(value: Any) -> Any:
    """``value`` as an HDF5 attribute: text and numbers as they are, lists and tables as JSON."""
    if isinstance(value, (str, bool, int, float, np.generic)):
        return value
    return json.dumps(plain(value), ensure_ascii=False)


class NoRoom(OSError):
    """The disk, a quota or a limit of the process leaves no room; nothing was written yet."""


class Elsewhere(OSError):
    """The path no longer names the file that is being written; the message names the place of the
    file."""


class Cut(OSError):
    """Another program has made the file shorter than what was written."""


def reserve(file: h5py.File, n_bytes: int) -> None:
    """Claim ``n_bytes`` [bytes] on the disk behind the end of an open file, whose path may name
    another file by now. Not collective.

    HDF5 updates its tables in place and appends the data: if the disk fills up in between, the
    tables point to data that are not there and the file is lost, and HDF5 crashes the interpreter
    at its end. Claimed space excludes that.

    Raises
    ------
    NoRoom
    """
    try:
        _claim(file.id.get_vfd_handle(), file.id.get_filesize(), n_bytes)
    except OSError as error:
        raise NoRoom(error.errno, error.strerror) from error


def check_in_place(path: Path, handle: int) -> None:
    """Raise ``Elsewhere`` unless ``path`` names the file open as ``handle``. Not collective."""
    with contextlib.suppress(OSError):
        if os.path.samestat(os.stat(path), os.fstat(handle)):
            return
    if os.fstat(handle).st_nlink == 0:
        if os.path.lexists(path):
            raise Elsewhere(
                f"{path} was replaced by another file while the run went on; that file is left as "
                "it is, what the run had written is lost"
            )
        what = path if path.parent.is_dir() else f"the folder {path.parent}"
        raise Elsewhere(
            f"{what} was removed while the run went on; what the run had written into it is lost"
        )
    try:
        now = Path(os.readlink(f"/proc/self/fd/{handle}"))
    except OSError:  # not Linux
        raise Elsewhere(
            f"{path} was moved while the run went on; what the run had written is there"
        ) from None
    raise Elsewhere(
        f"{path} is now {now}, moved while the run went on: what was written is there, and "
        f"`catenary restart {quote(str(now.parent))}` continues the run"
    )


def check_uncut(path: Path, handle: int, least: int) -> None:
    """Raise ``Cut`` if the file open as ``handle`` has fewer than ``least`` bytes [bytes].

    HDF5 reads what is gone as zeros, and crashes. Not collective.
    """
    if (size := os.fstat(handle).st_size) < least:
        raise Cut(
            f"another program has cut {path} to {size} bytes while the run went on; what the run "
            "had written into it is lost"
        )


def _claim(handle: int, start: int, n_bytes: int) -> None:
    if hasattr(os, "posix_fallocate"):
        try:
            os.posix_fallocate(handle, start, n_bytes)
            return
        except OSError as error:
            if error.errno not in (errno.EOPNOTSUPP, errno.EINVAL):
                raise
    # Neither the system nor the file system can claim: occupy the place.
    while n_bytes > 0:
        written = os.pwrite(handle, bytes(min(n_bytes, 1 << 20)), start)
        start, n_bytes = start + written, n_bytes - written


def abandon(file: h5py.File) -> None:
    """Close a file to which a write has failed, without touching the disk again.

    HDF5 would repeat the failed writes until the program ends, spoil more of the file and crash
    the interpreter at its exit; so it gets memory to write to.
    """
    if hasattr(os, "memfd_create"):
        sink = os.memfd_create("abandoned")
        os.dup2(sink, file.id.get_vfd_handle())
        os.close(sink)
    with contextlib.suppress(OSError, RuntimeError):
        file.close()


def open_to_write(path: Path, mode: str, **how: Any) -> h5py.File:
    """An HDF5 file opened for writing, with HDF5's lock where the file system has locks.

    HDF5 refuses a file that it cannot lock. The result folder has a lock of its own that needs
    none of the file system, so that this one may be missing.

    Parameters
    ----------
    path : Path
        Path of the file.
    mode : str
        Mode of ``h5py.File``.
    **how : object
        Further arguments of ``h5py.File``.

    Raises
    ------
    InputError
        If a file that is there already is no regular file, or its tables lie in other files.
    OSError
        If it cannot be opened.
    """
    opener = h5py.File if mode == "w" else open_own
    try:
        return opener(path, mode, **how)
    except OSError as error:
        if code_of(error) not in _NO_LOCKS:
            raise
    return opener(path, mode, locking=False, **how)


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
    if not head.startswith(_SIGNATURE) or head[8] not in _VERSIONS or head[9] != 8:
        return None
    (end,) = struct.unpack_from("<Q", head, _END_AT)
    return int(end)


@contextlib.contextmanager
def opened(path: Path, mode: str) -> Iterator[h5py.File]:
    """An HDF5 file opened in a ``mode`` for writing, cut to its contents at the end. A context
    manager.

    It is abandoned if something fails.

    Raises
    ------
    InputError
        If a file that is there already is no regular file, or its tables lie in other files.
    """
    file = open_to_write(path, mode, libver=FORMAT_BOUNDS)
    try:
        yield file
        file.flush()
    except Exception:
        abandon(file)
        raise
    with trimmed(file):
        file.close()


def broken_write(path: Path, time: float, error: Exception, begun: bool = True) -> RunBroken:
    """The error for the user when writing ``path`` failed at ``time`` [s] of the simulation.

    ``begun`` says whether the run has results yet, in place of those of an earlier one.
    """
    if isinstance(error, Elsewhere | Cut):
        return RunBroken(f"the run ended at t = {time:.3f} s because {error}")
    kept = (
        "what was written before stays readable"
        if begun
        else "nothing was written, and results of an earlier run are as they were"
    )
    return RunBroken(
        f"writing {path} failed at t = {time:.3f} s ({reason(error)}): {remedy(error)}; {kept}"
    )


def write_whole(path: Path, content: bytes | str) -> None:
    """Write ``content`` to a file so that it appears whole or not at all."""
    data = content.encode() if isinstance(content, str) else content
    with appears_whole(path) as partial:
        partial.write_bytes(data)


def write_at(handle: int, offset: int, numbers: np.ndarray) -> None:
    """Write contiguous ``numbers`` into an open file, ``offset`` [bytes] from its beginning;
    ``handle`` is its descriptor.

    Raises
    ------
    OSError
        If not all of it could be written.
    """
    left = numbers.reshape(-1).view(np.uint8).data  # an empty array cannot be cast
    while left.nbytes:
        written = os.pwrite(handle, left, offset)
        left, offset = left[written:], offset + written


def write_all(folder: Path, content: Mapping[str, bytes | str]) -> list[Path]:
    """Write files of a folder by name, each as ``write_whole``; returns their paths.

    The folder is made if it is not there.

    Raises
    ------
    RunBroken
        If one cannot be written.
    """
    try:
        # `parents=True` calls itself for each folder, and a path may have a thousand.
        for one in reversed([one for one in (folder, *folder.parents) if not one.is_dir()]):
            one.mkdir(exist_ok=True)
    except OSError as error:
        raise unwritten(folder, error) from error
    return write_into(folder, content)


def write_into(folder: Path, content: Mapping[str, bytes | str]) -> list[Path]:
    """Write files as ``write_all``, into a folder that exists.

    Raises
    ------
    RunBroken
        If one cannot be written.
    """
    for name, data in content.items():
        try:
            write_whole(folder / name, data)
        except OSError as error:
            raise unwritten(folder / name, error) from error
    return [folder / name for name in content]


def unwritten(path: Path, error: Exception) -> RunBroken:
    """The error for the user where a file or folder could not be written."""
    return RunBroken(
        f"writing {path} failed ({reason(error)}): {remedy(error)}; what was written before stays "
        "readable"
    )
