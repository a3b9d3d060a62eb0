"""Files of users: whether paths name them, and how they appear whole or not at all.

A path that cannot be looked up is bad input. A file is made under another name beside its own, and
takes its own when it is whole.
"""

from __future__ import annotations

import contextlib
import errno
import os
import stat
from collections.abc import Iterator
from pathlib import Path

from catenary.base.errors import InputError

_REMEDIES = {
    errno.EACCES: "ask the owner of the folders on its way for permission, or name another",
    errno.ENAMETOOLONG: "choose a shorter name",
}
_LONGEST = 300  # characters of a path that a sentence repeats
_MOST = 100  # letters of a name that are kept; with what is added it may have 255 bytes


def is_file(path: Path) -> bool:
    """Whether there is a regular file. Not collective; see ``is_there``."""
    return stat.S_ISREG(_mode(path))


def is_folder(path: Path) -> bool:
    """Whether there is a folder. Not collective; see ``is_there``."""
    return stat.S_ISDIR(_mode(path))


def is_there(path: Path) -> bool:
    """Whether there is a file, a folder or a device. Not collective.

    Raises
    ------
    InputError
        If that cannot be known, as in a folder of another user, or for a name that is too long:
        ``Path.exists`` raises an error of the system then.
    """
    return bool(_mode(path))


def _mode(path: Path) -> int:
    """Kind and permissions of what a path names, 0 if there is nothing."""
    try:
        return os.stat(path).st_mode
    except (FileNotFoundError, NotADirectoryError, ValueError):  # the last: a null byte
        return 0
    except OSError as error:
        if error.errno == errno.ELOOP:
            return 0
        name = str(path) if len(str(path)) <= _LONGEST else f"{str(path)[:_LONGEST]}..."
        remedy = _REMEDIES.get(error.errno or 0, "name another")
        raise InputError(f"{name} cannot be looked up ({error.strerror}): {remedy}") from error


def part_of(path: Path, process: int, end: str = "") -> Path:
    """Name under which a process makes a file that is to appear whole; ``end`` is its last part."""
    return path.with_name(f".{path.name[:_MOST]}.{process}.part{end}")


def new_part(path: Path, end: str = "") -> Path:
    """The name for this process, free to be written: a file of a dead process with the same number,
    or a link, is removed."""
    part = part_of(path, os.getpid(), end)
    part.unlink(missing_ok=True)
    return part


@contextlib.contextmanager
def appears_whole(path: Path, end: str = "") -> Iterator[Path]:
    """Another name for ``path`` while it is made, which takes its own when it is whole.

    A context manager. If something fails there is nothing new. ``end`` is the end of the other
    name, for programs that know the kind of a file by it.
    """
    partial = new_part(path, end)
    try:
        yield partial
        partial.replace(path)
    except BaseException:
        with contextlib.suppress(OSError):  # where nothing can be written the first error tells why
            partial.unlink(missing_ok=True)
        raise
