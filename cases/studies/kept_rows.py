"""Rows that a study keeps as it finds them: the same command continues one that was stopped.

Studies made of whole runs keep these instead, see ``studies/sweep``.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

from catenary.base.errors import RunBroken
from catenary.postproc.files.disk import plain
from catenary.postproc.files.disk_errors import reason

NAME = "rows_so_far.jsonl"


class KeptRows:
    """Rows in a file, each line with what they depend on and a checksum. Not collective.

    Parameters
    ----------
    folder : that of the study; None to keep nothing
    force : forget what is there
    """

    def __init__(self, folder: Path | None, force: bool = False) -> None:
        self._path = None if folder is None else folder / NAME
        self._rows: dict[str, Any] = {}
        if force:
            self.forget()
        if self._path is not None and self._path.is_file():
            with contextlib.suppress(OSError):  # what cannot be read is found again
                text = self._path.read_text(encoding="utf-8", errors="replace")
                self._rows = dict(map(_read, text.splitlines()))

    def get(self, depends_on: Any) -> Any:
        """Rows that are there, None if none or they are damaged.

        Parameters
        ----------
        depends_on : plain values and scenes' keys; with other ones rows are others
        """
        return self._rows.get(_key(depends_on))

    def keep(self, depends_on: Any, rows: Any) -> None:
        """Append rows, lists of plain values and of NumPy's scalars, to the file.

        Raises
        ------
        RunBroken
            If the disk refuses.
        """
        if self._path is None:
            return
        line = json.dumps([_key(depends_on), rows], default=lambda value: value.item())
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            with self._path.open("a", encoding="utf-8") as file:
                # On a line of its own, also behind one that a kill has cut.
                file.write(f"\n{zlib.crc32(line.encode()):08x} {line}\n")
        except OSError as error:
            raise RunBroken(f"{self._path} cannot be written ({reason(error)})") from error

    def rows(self, depends_on: Any, make: Callable[[], Any]) -> Any:
        """Rows that are there, or those made, which are then kept."""
        rows = self.get(depends_on)
        if rows is None:
            rows = make()
            self.keep(depends_on, rows)
        return rows

    def forget(self) -> None:
        """Remove the file, once the study's own table holds everything."""
        self._rows = {}
        if self._path is not None:
            self._path.unlink(missing_ok=True)


def _key(depends_on: Any) -> str:
    return hashlib.sha256(json.dumps(plain(depends_on), sort_keys=True).encode()).hexdigest()


def _read(line: str) -> tuple[str, Any]:
    """Key and rows of a line; an empty key if it is damaged, as a kill leaves it."""
    checksum, _, content = line.partition(" ")
    try:
        if int(checksum, 16) == zlib.crc32(content.encode()):
            key, rows = json.loads(content)
            return str(key), rows
    except ValueError:
        pass
    return "", None
