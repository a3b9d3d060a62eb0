"""Records of a study's finished work, as files: the same command continues a stopped study.

A record is a JSON table with a checksum. It is left by whoever did the work, whichever process that
is, and appears whole. Runs have theirs in their folders (``sweep/run_jobs.py``); what is no run has
``KeptRows``.
"""

from __future__ import annotations

import hashlib
import json
import logging
import shutil
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from catenary.base.errors import InputError
from catenary.base.files import is_file
from catenary.base.parallel import on_root
from catenary.cases.process.interrupts import Interrupted
from catenary.cases.process.workers import Outcome, each, in_order
from catenary.cases.result_folder.folder_lock import held
from catenary.cases.result_folder.output_folder import remove_dead_parts
from catenary.cases.scene.input.plain_text import read_text
from catenary.postproc.files.disk import plain, write_all
from catenary.postproc.report.study_table import Content, write_files

logger = logging.getLogger("catenary.sweep")

FOLDER = "rows_so_far"
_SUM = "crc32"


def write_record(path: Path, content: Mapping[str, Any]) -> None:
    """Write a table of values of JSON with its checksum. Not collective.

    Raises
    ------
    RunBroken
        If the disk refuses.
    """
    text = json.dumps({**content, _SUM: _sum(content)})
    write_all(path.parent, {path.name: text + "\n"})


def read_record(path: Path) -> dict[str, Any] | None:
    """A record, None if there is none or it is damaged, which is logged. Not collective."""
    content = read_table(path)
    if content is None:
        return None
    known = content.pop(_SUM, None)
    return content if is_whole(path, known == _sum(content)) else None


def read_table(path: Path) -> dict[str, Any] | None:
    """A JSON table, None if there is no file or no whole table in it, which is logged."""
    if not is_file(path):  # a pipe would be waited for
        return None
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except OSError:
        return None
    except (ValueError, RecursionError):
        content = None
    return content if is_whole(path, isinstance(content, dict)) else None


def read_study(path: Path, verb: str) -> dict[str, Any]:
    """The JSON table that a verb has left. Not collective.

    Parameters
    ----------
    path : its file
    verb : the command that writes it, for sentences

    Raises
    ------
    InputError
        If there is no such file, or something else in it.
    """
    try:
        found = json.loads(read_text(path, f"{path}, the record of `{verb}`,"))
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path} is no record of `{verb}`: it is no JSON") from error
    if not isinstance(found, dict):
        raise InputError(f"{path} is no record of `{verb}`: it holds no table")
    return found


def is_whole(path: Path, whole: bool) -> bool:
    """Log that a file is damaged, if it is; returns whether it is not."""
    if not whole:
        logger.warning("%s is damaged: its part of the study is repeated", path)
    return whole


def _sum(content: Mapping[str, Any]) -> int:
    return zlib.crc32(json.dumps(content, sort_keys=True).encode())


class KeptRows:
    """Rows of a study other than figures of runs, a record for each piece of work.

    Parameters
    ----------
    folder : folder of the study; None to keep nothing
    force : delete kept rows first
    """

    def __init__(self, folder: Path | None, force: bool = False) -> None:
        self._folder = None if folder is None else folder / FOLDER
        if force:
            self.forget()

    def each(
        self,
        function: Callable[[Any, Any], Any],
        items: Sequence[Any],
        depends_on: Callable[[Any], Any],
        n_at_once: int,
        comm: Any,
        initialise: Callable[[], object] | None = None,
    ) -> Iterator[Outcome]:
        """Results of ``function(item, comm)``, kept or new, in the order of the items. Collective.

        Lists of plain values and of NumPy's scalars, as JSON holds them if they were kept.

        Parameters
        ----------
        function, n_at_once, comm, initialise : as of ``workers.each``
        depends_on : plain values and scenes' keys for an item; with other ones rows are others

        Raises
        ------
        Interrupted
            If a signal ended work that had begun; the rows that are done come first.
        """
        all_of = [depends_on(item) for item in items]
        there = on_root(comm, lambda: list(map(self.get, all_of)))
        left = [number for number, rows in enumerate(there) if rows is None]

        def come() -> Iterator[Outcome]:
            yield from (Outcome(i, rows) for i, rows in enumerate(there) if rows is not None)
            work = ((all_of[number], items[number]) for number in left)
            for outcome in each(
                partial(_kept_work, self, function), work, n_at_once, comm, initialise
            ):
                yield outcome._replace(number=left[outcome.number])

        n_left = len(items)
        for outcome in in_order(come()):
            n_left -= 1
            yield outcome
        if n_left:
            raise Interrupted("the study was interrupted; the same command continues it")

    def get(self, depends_on: Any) -> Any:
        """Rows that are there, None if none or they are damaged. Not collective."""
        path = self.path_of(depends_on)
        record = None if path is None else read_record(path)
        return None if record is None else record["rows"]

    def keep(self, depends_on: Any, rows: Any) -> None:
        """Leave a record of rows. Not collective; RunBroken if the disk refuses."""
        if (path := self.path_of(depends_on)) is not None:
            rows = json.loads(json.dumps(rows, default=lambda value: value.item()))
            write_record(path, {"rows": rows})

    def path_of(self, depends_on: Any) -> Path | None:
        """The file of a record, None if nothing is kept."""
        if self._folder is None:
            return None
        text = json.dumps(plain(depends_on), sort_keys=True)
        return self._folder / f"{hashlib.sha256(text.encode()).hexdigest()}.json"

    def remove_parts(self) -> None:
        """Remove parts of files that killed processes left. Not collective; only who holds the lock
        of the study's folder may."""
        if self._folder is not None:
            remove_dead_parts(self._folder)

    def forget(self) -> None:
        """Remove all records, once the study's own table holds everything. Not collective."""
        if self._folder is not None:
            shutil.rmtree(self._folder, ignore_errors=True)


# Keeps nothing.
NOTHING_KEPT = KeptRows(None)


def _kept_work(
    kept: KeptRows, function: Callable[[Any, Any], Any], what: tuple[Any, Any], comm: Any
) -> Any:
    """Work that leaves a record, as the processes do that do some. Collective."""
    depends_on, item = what
    rows = function(item, comm)
    on_root(comm, lambda: kept.keep(depends_on, rows))
    return rows


@dataclass(frozen=True)
class HeldStudy:
    """A study whose folder this process holds, from ``held_study``.

    Attributes
    ----------
    out : the folder, None to write nothing
    comm : mpi4py communicator
    kept : rows that are there from an earlier call
    """

    out: Path | None
    comm: Any
    kept: KeptRows

    def write(self, content: Callable[[], Mapping[str, Content]]) -> list[Path]:
        """Write all files of the study, then delete its kept rows; returns the files. Collective.

        ``content`` is called on rank 0, and only if there is a folder.
        """
        out = self.out
        if out is None:
            return []

        def work() -> list[Path]:
            files = write_files(out, content())
            self.kept.forget()
            return files

        files: list[Path] = on_root(self.comm, work, takes_long=True)
        return files


@contextmanager
def held_study(
    out: Path | None, comm: Any, command: str, force: bool = False
) -> Iterator[HeldStudy]:
    """Lock the folder of a study. Collective.

    Parameters
    ----------
    out : the folder, None to keep and write nothing
    comm : mpi4py communicator
    command : work of this process in words, for other processes that find the folder locked
    force : delete kept rows first
    """

    if out is None:
        yield HeldStudy(None, comm, NOTHING_KEPT)
        return
    with held(out, comm, command):
        kept = KeptRows(out, force and comm.rank == 0)
        on_root(comm, kept.remove_parts)
        yield HeldStudy(out, comm, kept)
