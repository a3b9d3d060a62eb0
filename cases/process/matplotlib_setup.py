"""Set-up of Matplotlib before its import: a folder for its cache, and no settings of the user's.

Pictures have the program's own style. Matplotlib reads a ``matplotlibrc`` at import: that in the
working directory, else that of ``MATPLOTLIBRC``, else that of the user. One that is no text ends
the import.
"""

from __future__ import annotations

import contextlib
import logging
import os
import stat
import tempfile
from collections.abc import Iterator
from pathlib import Path

VARIABLE = "MPLCONFIGDIR"
_SETTINGS, _FILE = "MATPLOTLIBRC", Path("matplotlibrc")


def leave_out_settings() -> None:
    """See to it, before Matplotlib is imported, that it reads no ``matplotlibrc`` of a user's.

    Where the working directory has one it is imported here, from a folder that has none.
    """
    os.environ[_SETTINGS] = os.devnull
    if os.path.lexists(_FILE):
        with contextlib.chdir(Path(__file__).parent):
            import matplotlib  # noqa: F401


def choose_folder() -> None:
    """Set the folder of its cache, before it is imported, where the user has no home that can be
    written."""
    if VARIABLE in os.environ or _may_be_made(_default()):
        return
    for base in _bases():
        if _is_writable(base):
            os.environ[VARIABLE] = str(base / "matplotlib")
            return
    # It takes a temporary folder for this process; its warning is not needed.
    logging.getLogger("matplotlib").setLevel(logging.ERROR)


def _default() -> Path:
    try:
        return Path(os.environ.get("XDG_CONFIG_HOME") or Path.home() / ".config") / "matplotlib"
    except RuntimeError:  # a user without a home
        return Path("/nonexistent")


def _may_be_made(path: Path) -> bool:
    """Whether a folder is there and can be written, or can be made."""
    try:
        there = next((one for one in (path, *path.parents) if one.exists()), None)
    except OSError:  # a home that this user may not search, as that of who called sudo
        return False
    return there is not None and there.is_dir() and os.access(there, os.W_OK | os.X_OK)


def _bases() -> Iterator[Path]:
    """Folders to try for what is kept between runs, the best first."""
    if chosen := os.environ.get("XDG_CACHE_HOME"):
        yield Path(chosen).absolute() / "catenary"
    with contextlib.suppress(OSError):  # no folder for temporary files, or one of another user
        temporary = Path(tempfile.gettempdir()) / f"catenary-{os.geteuid()}"
        temporary.mkdir(mode=0o700, exist_ok=True)
        if _is_private(temporary):
            yield temporary


def _is_private(path: Path) -> bool:
    """Whether a folder is this user's and nobody else may write."""
    status = path.lstat()
    owned = status.st_uid == os.geteuid()
    return owned and stat.S_ISDIR(status.st_mode) and not status.st_mode & 0o077


def _is_writable(path: Path) -> bool:
    """Whether files can be made in a folder, which is made if need be."""
    try:
        path.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=path).close()
        return True
    except OSError:
        return False
