"""Whether paths of users name files or folders; one that cannot be looked up is bad input."""

from __future__ import annotations

import errno
import os
import stat
from pathlib import Path

from catenary.base.errors import InputError

_REMEDIES = {
    errno.EACCES: "ask the owner of the folders on its way for permission, or name another",
    errno.ENAMETOOLONG: "choose a shorter name",
}
_LONGEST = 300  # characters of a path that a sentence repeats


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
