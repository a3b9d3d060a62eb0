"""Opens HDF5 files of a result folder; refuses links and tables that lie in another file.

HDF5 follows links and external storage by itself. A file from a stranger could so read, and a run
that is continued overwrite, any file of the user. Not collective.
"""

from __future__ import annotations

import os
import stat
from pathlib import Path
from typing import Any

import h5py
from h5py import h5d, h5l, h5o, h5s

from catenary.base.errors import InputError

# Description of a link or a table that leads elsewhere, in the error.
_LINKS = {h5l.TYPE_SOFT: "is a soft link", h5l.TYPE_EXTERNAL: "is a link into another file"}
_OWN_KINDS = {
    stat.S_IFLNK: "is a symbolic link, and result files are not opened through links; name the "
    "folder in which the file itself lies",
    stat.S_IFDIR: "is a folder",
}


def open_own(path: Path, mode: str = "r", **options: Any) -> h5py.File:
    """An HDF5 file all of whose tables lie in itself, open for reading or for changes.

    Parameters
    ----------
    path : Path
        A regular file; a symbolic link is not followed, a pipe not waited for.
    mode : str, optional
        "r" or "r+".
    **options : object
        Further arguments of ``h5py.File``.

    Raises
    ------
    InputError
        If it is no regular file, or holds a soft or external link, a table with external storage
        or a virtual table; nothing of the other file was read.
    OSError, RuntimeError
        If HDF5 cannot open the file, or not list its tables.
    """
    refuse_irregular(path)
    file = h5py.File(path, mode, **options)
    try:
        fault = _leads_elsewhere(file)
        if fault:
            raise InputError(
                f"{path} is refused: {fault}; a result file must hold all of its tables itself"
            )
    except BaseException:
        file.close()
        raise
    return file


def refuse_irregular(path: Path) -> None:
    """Raise InputError if a path names a link, pipe, device or folder; OSError if nothing."""
    kind = stat.S_IFMT(os.lstat(path).st_mode)
    if kind != stat.S_IFREG:
        raise InputError(f"{path} {_OWN_KINDS.get(kind, 'is a pipe or a device, not a file')}")


def _leads_elsewhere(file: h5py.File) -> str:
    """The first link or table that leads out of a file, as a clause; empty if there is none."""

    size = os.fstat(file.id.get_vfd_handle()).st_size

    def judge(name: bytes, link: Any) -> str | None:
        if link.type != h5l.TYPE_HARD:
            return f"{_text(name)} {_LINKS.get(link.type, 'is a link of an unknown kind')}"
        try:
            item = h5o.open(file.id, name)
        except (OSError, RuntimeError, KeyError, ValueError):
            return None  # it is damaged: nobody can open it
        if not isinstance(item, h5d.DatasetID):
            return None
        how = item.get_create_plist()
        if how.get_layout() == h5d.VIRTUAL:
            return f"{_text(name)} is a virtual table, whose numbers lie in other files"
        if how.get_external_count():
            return f"{_text(name)} keeps its numbers in another file"
        return _oversize(name, item, size)

    found: str | None = file.id.links.visit(judge, info=True)
    return found or ""


def _oversize(name: bytes, table: h5d.DatasetID, size: int) -> str | None:
    """The clause for a table of a fixed length that is larger than its file of ``size`` [B]: it
    would be made up of numbers that nobody wrote, and may not fit into memory. Ours are not
    compressed."""
    space = table.get_space()
    if space.get_simple_extent_ndims() == 0 or h5s.UNLIMITED in space.get_simple_extent_dims(True):
        return None
    takes = space.get_simple_extent_npoints() * table.get_type().get_size()
    return f"{_text(name)} has {takes:.3g} bytes and the file {size:.3g}" if takes > size else None


def _text(name: bytes) -> str:
    return name.decode(errors="replace")
