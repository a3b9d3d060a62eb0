"""Folder of a run's results, or file of a verb, judged before all computing: names, files, room."""

from __future__ import annotations

import contextlib
import errno
import logging
import os
import stat
from collections.abc import Container, Iterable
from pathlib import Path
from typing import NamedTuple

from catenary.base.errors import InputError
from catenary.base.files import is_folder, is_there, new_part, part_of
from catenary.base.options import option
from catenary.cases.result_folder.folder_lock import is_alive, refusal
from catenary.postproc.evaluate.wording import duration
from catenary.postproc.files.own_files import (
    FIELD_FILES,
    OWN_FILES,
    RUN_FILE,
    parts_in,
    remove_parts,
)

logger = logging.getLogger("catenary.run")

# A run beyond one of these needs --force.
MOST_BYTES = 20e9
MOST_SECONDS = 12 * 3600.0
MOST_STEPS = 5_000_000
# A run beyond one of these is announced [bytes], [s].
LARGE = 1e9
LONG = 600.0

_HDF5 = b"\x89HDF\r\n\x1a\n"


class RunSize(NamedTuple):
    """Estimated size of a run.

    Attributes
    ----------
    n_bytes : of its result files [bytes]
    seconds : wall time of its time loop [s]
    n_steps : number of steps
    """

    n_bytes: float
    seconds: float
    n_steps: int


def prepare(folder: Path, force: bool) -> None:
    """Refuse a folder that holds results or cannot take all files of a run. Not collective.

    The folder is there and locked by this process. Parts of files that dead runs left are removed.

    Raises
    ------
    InputError
        If there are results and ``force`` is not given, or if a file with the longest name of all
        cannot be written.
    """
    refuse_earlier(folder, force)
    remove_parts(folder)
    trial = part_of(folder / max(OWN_FILES, key=len), os.getpid())
    try:
        new_part(folder / max(OWN_FILES, key=len))
        with trial.open("wb", buffering=0) as file:
            file.write(b"trial")
    except OSError as error:
        raise refusal(folder, error) from error
    finally:
        with contextlib.suppress(OSError):
            trial.unlink()


def remove_dead_parts(folder: Path, names: Container[str] | None = None) -> None:
    """Remove parts of files that killed processes left. Not collective.

    Only who holds the folder's lock may.

    Parameters
    ----------
    folder : Path
        It need not be there.
    names : container of str, optional
        The files; all if absent.
    """
    for path, name, process in parts_in(folder):
        if (names is None or name in names) and not is_alive(process):
            with contextlib.suppress(OSError):
                path.unlink()


def refuse_no_folder(folder: Path) -> None:
    """Raise InputError if a path is no folder where the folder of a run is wanted."""
    if not is_folder(folder):
        raise InputError(f"{folder} is no folder; name the folder of a run")


def run_folder(path: str | Path) -> Path:
    """The folder of a run, for which its result file may stand. Not collective."""
    path = Path(path)
    # Options are read by this: what cannot be looked up is told by the verb.
    return path.parent if path.name == RUN_FILE and os.path.isfile(path) else path


def refuse_impossible(folder: Path) -> None:
    """Raise InputError if a folder of this name cannot be, without making it. Not collective."""
    try:
        found = os.stat(folder)
    except FileNotFoundError:
        # Whether it can be made is seen when the folder is locked; this takes no time.
        above = next(path for path in folder.absolute().parents if path.exists())
        if not os.access(above, os.W_OK | os.X_OK):
            read_only = os.statvfs(above).f_flag & os.ST_RDONLY
            code = errno.EROFS if read_only else errno.EACCES
            raise refusal(folder, OSError(code, os.strerror(code))) from None
        return
    except OSError as error:
        raise refusal(folder, error) from error
    if not stat.S_ISDIR(found.st_mode):
        raise InputError(f"{folder} is a file; name a folder for the results")


def refuse_table(folder: Path | None, name: str, force: bool) -> None:
    """Raise InputError if a file of an earlier study may not be replaced, or not be written.

    Not collective. Without a ``folder`` none is.
    """
    if folder is None:
        return
    refuse_impossible(folder)
    path = folder / name
    if not force and is_there(path):
        raise InputError(f"{path} is there already; {another_folder()}, or give {force_option()}")


def another_folder() -> str:
    """The advice to write elsewhere, for sentences."""
    return f"name another folder with {option('-o', 'out')}"


def force_option() -> str:
    """The option that overwrites results and runs large runs, for sentences."""
    return option("--force", "force=True")


def refuse_earlier(folder: Path, force: bool) -> None:
    """Raise InputError if a folder holds a run's results and ``force`` is not given."""
    result = folder / RUN_FILE
    if is_folder(result) and not result.is_symlink():
        raise InputError(f"{result} is a folder; remove it, or {another_folder()}")
    if force or not os.path.lexists(result):
        return
    what = "holds the results of an earlier run"
    if not is_there(result):
        what = "is a link that leads nowhere"
    elif not _is_hdf5(result):
        what = "is there already, and is no result file"
    raise InputError(
        f"{result} {what}; {another_folder()}, or give {force_option()} to replace "
        f"{'them' if 'results' in what else 'it'}"
    )


def check_size(folder: Path, size: RunSize, force: bool) -> None:
    """Announce a large run; refuse one beyond the bounds or without room. Not collective.

    The files that the run is to replace count as room.

    Raises
    ------
    InputError
        Unless ``force`` is given.
    """
    room = free_bytes(folder) + _bytes_of_run(folder, replaced=True)
    takes = _check_room(folder, size, room, force)
    beyond = size.n_bytes > MOST_BYTES or size.seconds > MOST_SECONDS or size.n_steps > MOST_STEPS
    if beyond and not force:
        raise InputError(
            f"the run is very large: {takes}; beyond {volume(MOST_BYTES)}, "
            f"{duration(MOST_SECONDS)} or {MOST_STEPS} steps give {force_option()} to run it "
            "all the same"
        )
    if beyond or size.n_bytes > LARGE or size.seconds > LONG:
        logger.info(takes)


def check_room_to_continue(folder: Path, size: RunSize, force: bool) -> None:
    """Refuse to continue a run without room for the rest of its files. Not collective.

    Parameters
    ----------
    size : of the whole run

    Raises
    ------
    InputError
        Unless ``force`` is given.
    """
    room = free_bytes(folder) + _bytes_of_run(folder)
    _check_room(folder, size, room, force, advice="")


def check_room_of_runs(folder: Path, folders: Iterable[Path], size: RunSize, force: bool) -> None:
    """Refuse several runs without room for all of them. Not collective.

    Parameters
    ----------
    folder : in which all are, the deepest that is there counts
    folders : of the runs that are still to be made; their old files count as room
    size : of these runs together

    Raises
    ------
    InputError
        Unless ``force`` is given.
    """
    there = next(path for path in (folder, *folder.absolute().parents) if path.is_dir())
    room = free_bytes(there) + sum(_bytes_of_run(each, replaced=True) for each in folders)
    _check_room(folder, size, room, force)


def _check_room(
    folder: Path, size: RunSize, room: float, force: bool, advice: str | None = None
) -> str:
    """What runs take, in words; InputError if that is more than the ``room`` [bytes], unless
    ``force`` is given."""
    takes = (
        f"{size.n_steps} steps take about {duration(size.seconds)} and {volume(size.n_bytes)} in "
        f"{folder}, where {volume(room)} are free"
    )
    if not force and size.n_bytes > room:
        advice = f"{another_folder()}, record less, " if advice is None else advice
        raise InputError(
            f"there is no room for the results: {takes}; free some space, {advice}or give "
            f"{force_option()} to run until the disk is full"
        )
    return takes


def free_bytes(folder: Path) -> float:
    """Space left for this user on the disk of a folder [bytes]."""
    try:
        found = os.statvfs(folder)
    except OSError as error:
        raise refusal(folder, error) from error
    return float(found.f_bavail) * found.f_frsize


def _bytes_of_run(folder: Path, replaced: bool = False) -> float:
    """Blocks on the disk of the files of a run, or of those that a new run frees when it replaces
    them [bytes]."""
    total = 0.0
    for name in (RUN_FILE, *FIELD_FILES):
        with contextlib.suppress(OSError):
            one = (folder / name).lstat()
            total += 512.0 * one.st_blocks * (one.st_nlink == 1 or not replaced)
    return total


def _is_hdf5(path: Path) -> bool:
    if not path.is_file():  # a pipe would be waited for
        return False
    try:
        with path.open("rb") as file:
            return file.read(len(_HDF5)) == _HDF5
    except OSError:
        return False


def volume(n_bytes: float) -> str:
    """A size in words: MB below one GB."""
    return f"{n_bytes / 1e9:.1f} GB" if n_bytes >= 1e9 else f"{n_bytes / 1e6:.1f} MB"


def new_file(path: Path, suffixes: tuple[str, ...], force: bool) -> None:
    """Make the folder of a file; raise ``InputError`` unless ``path`` can be written with one of
    ``suffixes``."""
    out = option("-o", "out")
    if path.suffix not in suffixes:
        raise InputError(f"{out} {path} must have a name that ends in {' or '.join(suffixes)}")
    if is_folder(path):
        raise InputError(f"{out} {path} is a folder; name a file")
    if is_there(path) and not force:
        raise InputError(f"{out} {path} exists already; give {force_option()} to replace it")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{out} {path} cannot be written: {error.strerror}") from error
    goes_into = path if is_there(path) else path.parent
    if not os.access(goes_into, os.W_OK):
        read_only = os.statvfs(goes_into).f_flag & os.ST_RDONLY
        why = "read-only file system" if read_only else "permission denied"
        raise InputError(f"{out} {path} cannot be written: {why}")
