"""Marches variants of a case for their statistics, and holds the folder of a study."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from catenary.base.parallel import on_root
from catenary.cases.process.interrupts import Interrupted
from catenary.cases.studies.sweep.jobs import Ended, RunOptions, interrupted
from catenary.cases.studies.sweep.together import ensemble_of, run_ensemble
from catenary.cases.studies.sweep.variants import Variant

if TYPE_CHECKING:
    from catenary.cases.scene.load import Draft

Write = Callable[[Callable[[Path], list[Path]]], list[Path]]


class Marching:
    """Marches variants of a case side by side, of which statistics are kept.

    Parameters
    ----------
    draft : the case
    overrides : assignments for all variants
    out : folder that keeps what is done, so that the same calls continue; None to keep nothing
    comm : mpi4py communicator
    options : how they are marched

    Attributes
    ----------
    case : name of the case, empty before the first call
    """

    def __init__(
        self,
        draft: Draft,
        overrides: Sequence[str],
        out: Path | None,
        comm: Any,
        options: RunOptions,
    ) -> None:
        self._draft, self._overrides, self._out = draft, overrides, out
        self._comm, self._options = comm, options
        self.case = ""

    def of(self, variants: Sequence[Variant]) -> list[Ended]:
        """How each variant ended, in their order. Collective.

        Raises
        ------
        InputError
            If none of them can be run.
        Interrupted
            If a signal came.
        """
        ensemble = ensemble_of(self._draft, variants, self._overrides)
        self.case = ensemble.first.case.name
        ended = run_ensemble(ensemble, self._out, self._comm, self._options)
        self._options = self._options._replace(force=False)  # which would forget these
        if interrupted(ended):
            raise Interrupted("the study was interrupted; the same command continues it")
        return ended


@contextmanager
def kept_in(out: Path | None, comm: Any, command: str) -> Iterator[Write]:
    """Hold a folder; gives what writes a study's files into it, which makes the kept rows needless.

    Collective.

    Parameters
    ----------
    out : the folder, None to write nothing
    command : what this process does, for others that want the folder
    """
    if out is None:
        yield lambda write: []
        return
    from catenary.cases.result_folder.folder_lock import held
    from catenary.cases.studies.records import KeptRows

    def written(write: Callable[[Path], list[Path]]) -> list[Path]:
        def work() -> list[Path]:
            files = write(out)
            KeptRows(out).forget()
            return files

        files: list[Path] = on_root(comm, work, takes_long=True)
        return files

    with held(out, comm, command):
        yield written
