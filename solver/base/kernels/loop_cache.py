"""Folder in which Numba keeps compiled loops: one that can be written, named after their sources.

Numba compiles anew what stands in a changed file, but not what calls that from another file.
Therefore the folder's name holds a digest of all files that loops come from.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import logging
import os
import re
import shutil
import stat
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

VARIABLE = "CATENARY_CACHE_DIR"
_PACKAGE = Path(__file__).parents[3]  # holds solver and mbs, in a checkout and installed
_IN_TREE = _PACKAGE / "solver" / "__pycache__"
_LEAST_SPACE = 50e6  # [bytes], of which a run's loops take half
_OLD = 30 * 86400.0  # [s] without use, after which the loops of other sources are removed

# What a file with loops has; a file that only mentions it does no harm.
_MARK = re.compile(rb"\n@(?:compiled|addressed|in_line|inner|called|intrinsic)")
# Begins with a plain word, for which an expression is searched ten times as fast as for a choice.
_IMPORT = re.compile(rb"catenary\.([\w.]+)(?: import (\([^)]*\)|.*))?")
_NAME = re.compile(rb"\w+")


@functools.cache
def folder(numba_version: str) -> Path | None:
    """Where compiled loops are kept; None if no folder can be written, which is logged once.

    Not collective. Loops that a read-only installation brings for these sources are copied.
    """
    name = f"loops-{digest(sources(_PACKAGE), numba_version)}"
    for base in bases():
        target = base / name
        if target.is_dir() and is_writable(target):
            with contextlib.suppress(OSError):
                os.utime(target)
            return target
        if is_writable(base):
            _remove_unused(base)
            return _filled(target, _IN_TREE / name)
    chosen = os.environ.get(VARIABLE)
    reason = f"{chosen} cannot be written" if chosen else "no folder can be written"
    logging.getLogger("catenary").warning(
        f"compiled loops are not kept, every run compiles them anew: {reason} ({VARIABLE})"
    )
    return None


def sources(package: Path) -> list[Path]:
    """Files that hold loops and all that they import, from which their constants come; sorted."""
    # Every start of the program does this: names and bytes take a third of the time of paths and
    # text.
    places = (f"{package}/{part}" for part in ("solver", "mbs"))
    texts = {
        path: _read(path)
        for place in places
        for folder, _, files in os.walk(place)
        for file in files
        if (path := f"{folder}/{file}").endswith(".py")
    }
    found = [path for path, text in texts.items() if _MARK.search(text)]
    seen = set(found)
    for path in found:
        for other in _imported(texts[path], str(package)):
            if other in texts and other not in seen:
                seen.add(other)
                found.append(other)
    return sorted(map(Path, found))


def _read(path: str) -> bytes:
    with open(path, "rb", buffering=0) as file:
        return file.read()


def _imported(text: bytes, package: str) -> Iterator[str]:
    """Files that may stand behind the imports of a source."""
    for module, names in _IMPORT.findall(text):
        place = f"{package}/{module.decode().replace('.', '/')}"
        yield f"{place}.py"
        yield from (f"{place}/{name.decode()}.py" for name in _NAME.findall(names))


def digest(files: list[Path], numba_version: str) -> str:
    """Twelve digits that change with any of the files and with Numba's version."""
    text = hashlib.sha256(numba_version.encode())
    for path in files:
        text.update(path.read_bytes())
    return text.hexdigest()[:12]


def bases() -> Iterator[Path]:
    """Folders to try for what is kept between runs, the best first. Not collective."""
    if chosen := os.environ.get(VARIABLE):
        yield Path(chosen).absolute()
        return
    yield _IN_TREE
    with contextlib.suppress(RuntimeError):  # a user without a home
        if chosen := os.environ.get("XDG_CACHE_HOME"):
            yield Path(chosen).absolute() / "catenary"
        elif Path.home().is_dir():
            yield Path.home() / ".cache" / "catenary"
    with contextlib.suppress(OSError):  # no folder for temporary files, or one of another user
        temporary = Path(tempfile.gettempdir()) / f"catenary-{os.geteuid()}"
        temporary.mkdir(mode=0o700, exist_ok=True)
        if _is_private(temporary):
            yield temporary


def _is_private(path: Path) -> bool:
    """Whether a folder is this user's and nobody else may write: it holds code that will be run."""
    status = path.lstat()
    owned = status.st_uid == os.geteuid()
    return owned and stat.S_ISDIR(status.st_mode) and not status.st_mode & 0o077


def is_writable(path: Path) -> bool:
    """Whether files can be made in a folder, which is made if need be, with room for them."""
    try:
        path.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=path).close()
        return shutil.disk_usage(path).free > _LEAST_SPACE
    except OSError:
        return False


def _filled(target: Path, shipped: Path) -> Path:
    """Make ``target``, with the loops that lie in ``shipped``; never half filled."""
    try:
        if target.parent != shipped.parent and shipped.is_dir():
            copy = Path(tempfile.mkdtemp(prefix="copy-", dir=target.parent))
            try:
                shutil.copytree(shipped, copy / target.name)
                os.rename(copy / target.name, target)
            finally:
                shutil.rmtree(copy, ignore_errors=True)
    except OSError:  # another process was first, or a file of the installation cannot be read
        pass
    target.mkdir(exist_ok=True)
    return target


def _remove_unused(base: Path) -> None:
    """Remove loops of other sources that have not been used for a month."""
    for other in base.glob("loops-*"):
        with contextlib.suppress(OSError):
            if time.time() - other.stat().st_mtime > _OLD:
                shutil.rmtree(other, ignore_errors=True)
