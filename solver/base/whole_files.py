"""Files that appear whole or not at all: they are made under another name beside it."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path

_MOST = 100  # letters of a name that are kept; with what is added it may have 255 bytes


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
