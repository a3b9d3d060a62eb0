"""Reason and remedy, in words, of a file or folder that cannot be written."""

from __future__ import annotations

import errno
import os
import re

_OTHER_FOLDER = "choose another output folder"
_REMEDIES = {
    errno.ENOSPC: f"free some space or {_OTHER_FOLDER}",
    errno.EDQUOT: f"free some space or {_OTHER_FOLDER}",
    errno.EFBIG: f"raise the limit on the size of a file (`ulimit -f`) or {_OTHER_FOLDER}",
    errno.EMFILE: "raise the limit on the number of open files (`ulimit -n`)",
    errno.ENFILE: "end programs that have many files open, the machine's limit is reached",
    errno.EACCES: f"change the permissions there or {_OTHER_FOLDER}",
    errno.EPERM: f"change the permissions there or {_OTHER_FOLDER}",
    errno.EROFS: f"nothing can be written there, {_OTHER_FOLDER}",
    errno.ELOOP: f"links in its path lead in a circle, {_OTHER_FOLDER}",
    errno.ENAMETOOLONG: "choose a shorter name for the output folder",
    errno.ENOENT: f"its folder is gone or cannot be made, or a link leads nowhere, {_OTHER_FOLDER}",
    errno.ENOTDIR: f"a part of its path is a file and not a folder, {_OTHER_FOLDER}",
    errno.EISDIR: f"a folder has this name, {_OTHER_FOLDER}",
    errno.EEXIST: f"a file or a link that leads nowhere has this name, {_OTHER_FOLDER}",
    errno.EAGAIN: "another program has the file open and locked, close it there",
    errno.EIO: f"the disk fails, {_OTHER_FOLDER}",
    errno.ENOLCK: f"set HDF5_USE_FILE_LOCKING=FALSE in the environment or {_OTHER_FOLDER}",
    errno.ESTALE: f"the connection to the disk was lost, {_OTHER_FOLDER}",
}


def code_of(error: Exception) -> int | None:
    """The system's error number, also if HDF5 or ffmpeg hides it in its text; None without one."""
    code = getattr(error, "errno", None)
    if code:
        return int(code)
    hidden = re.search(r"errno = (\d+)", str(error))
    if hidden:
        return int(hidden.group(1))
    return next((one for one in _REMEDIES if str(error).endswith(os.strerror(one))), None)


def reason(error: Exception) -> str:
    """The system's message of an error, without a figure or a path."""
    code = code_of(error)
    if code:
        return os.strerror(code)
    # HDF5 hides the system's words among the figures of several lines.
    hidden = re.search(r"error message = '([^']*)'", str(error))
    return hidden.group(1) if hidden else str(error)


def remedy(error: Exception) -> str:
    """The remedy of an error, for the user."""
    code = code_of(error)
    return _REMEDIES.get(code, _OTHER_FOLDER) if code else _OTHER_FOLDER
