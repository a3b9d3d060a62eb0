"""Figures of many scenes at once, without files that stay."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from catenary.base.errors import CatenaryError
from catenary.cases.scene.scene import Scene

BROKE = "broke"
# A summary needs neither snapshots nor energies.
_LEAN = {"field_every_s": 0.0, "field_every_m": None, "energy_every_s": 0.0}


def evaluate(scenes: Sequence[Scene], workers: Executor | None = None) -> list[dict[str, Any]]:
    """The summary of each scene's run, in their order. Not collective.

    Parameters
    ----------
    scenes : as many as there are to be run: they share what they can
    workers : processes that share the runs, as ``workers`` gives them; this process if None

    Returns
    -------
    list of dict
        The content of ``summary.json`` of each; ``{"broke": sentence}`` of a run that ended early,
        or of a line that cannot hang.

    Raises
    ------
    KeyboardInterrupt
        If a signal ended a run.
    """
    runs = map(_summary, scenes) if workers is None else workers.map(_summary, scenes)
    return list(runs)


@contextmanager
def workers(n: int) -> Iterator[Executor | None]:
    """``n`` processes for ``evaluate``, None for one. Not collective.

    They start as new programs do, so that a script of a user must do its work below
    ``if __name__ == "__main__":`` to have more than one.
    """
    if n == 1:
        yield None
        return
    with ProcessPoolExecutor(n, mp_context=get_context("spawn")) as pool:
        yield pool


def _summary(scene: Scene) -> dict[str, Any]:
    from catenary.base.lone_process import alone
    from catenary.cases.process.interrupts import Interrupted
    from catenary.cases.process.petsc_options import options_of
    from catenary.cases.run.runner import run_case

    output = scene.output.model_copy(update=_LEAN)
    lean = scene.model_copy(update={"output": output})
    with tempfile.TemporaryDirectory(prefix="catenary_evaluate_") as folder:
        comm = alone()
        with options_of(lean.petsc.given()) as options:
            try:
                ended = run_case(
                    lean, Path(folder), comm, petsc_options=options, force=True, only_summary=True
                )
            except Interrupted as error:
                raise KeyboardInterrupt from error
            except CatenaryError as error:
                return {BROKE: str(error)}
    if ended.outcome == "interrupted":
        raise KeyboardInterrupt
    return ended.summary if ended.outcome == "done" else {BROKE: ended.outcome}
