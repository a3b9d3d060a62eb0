"""Figures of many scenes at once, without files that stay."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context
from typing import TYPE_CHECKING, Any, NamedTuple

from catenary.cases.process.workers import cores
from catenary.cases.scene.scene import Scene

if TYPE_CHECKING:
    from catenary.cases.studies.ensemble.scenes_on_lines import Marches

BROKE = "broke"


class Workers(NamedTuple):
    """``n`` processes that share runs."""

    pool: Executor
    n: int


def evaluate(scenes: Sequence[Scene], workers: Workers | None = None) -> list[dict[str, Any]]:
    """The summary of each scene's run, in their order. Not collective.

    Parameters
    ----------
    scenes : as many as there are to be run: those that share a line march side by side, and those
        that follow each other are marched by one process
    workers : processes that share the runs, as ``workers`` gives them; this process if None

    Returns
    -------
    list of dict
        The content of ``summary.json`` of each; ``{"broke": sentence}`` of a run that ended early,
        or of a line that cannot hang.
    """
    if workers is None:
        return _summaries(scenes)
    size = max(1, -(-len(scenes) // workers.n))
    pieces = [scenes[at : at + size] for at in range(0, len(scenes), size)]
    return [one for piece in workers.pool.map(_summaries, pieces) for one in piece]


@contextmanager
def workers(n: int) -> Iterator[Workers | None]:
    """``n`` processes for ``evaluate``, 0 for one on each core; None for one. Not collective.

    They start as new programs do, so that a script of a user must do its work below
    ``if __name__ == "__main__":`` to have more than one.
    """
    n = n or cores()
    if n == 1:
        yield None
        return
    with ProcessPoolExecutor(n, mp_context=get_context("spawn")) as pool:
        yield Workers(pool, n)


# Keeps the line of the latest scenes for those to come.
_marches: Marches | None = None


def _summaries(scenes: Sequence[Scene]) -> list[dict[str, Any]]:
    from catenary.base.lone_process import alone
    from catenary.cases.process.petsc_options import options_of

    alone()  # starts MPI as one process, before anything imports it
    from catenary.cases.studies.ensemble.scenes_on_lines import Marches
    from catenary.postproc.files.run_schema import DONE

    global _marches
    found: list[dict[str, Any]] = [{} for _ in scenes]
    if not scenes:
        return found
    with options_of(scenes[0].petsc.given()):
        _marches = _marches or Marches()
        for one in _marches.of(scenes):
            found[one.number] = one.summary if one.outcome == DONE else {BROKE: one.outcome}
    return found
