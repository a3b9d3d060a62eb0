"""Figures of many scenes at once, without files that stay: each run is made once."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from catenary.base.errors import InputError
from catenary.cases.process.interrupts import Interrupted
from catenary.cases.process.workers import Pool, cores, in_order
from catenary.cases.scene.problem import resolved
from catenary.cases.scene.scene import Scene
from catenary.cases.studies.records import KeptRows
from catenary.cases.studies.scene_sets.scene_set import Member, SceneSet
from catenary.cases.studies.sweep.jobs import OF_PANTOGRAPH

if TYPE_CHECKING:
    from catenary.cases.studies.ensemble import Marches

BROKE = "broke"
# Tables of a scene that its figures do not depend on.
_IDLE = ("case", "output", "test")
OF_EACH_PANTOGRAPH = tuple(column.name for column in OF_PANTOGRAPH)
# Statistics of the line: table and key in a summary.
_OF_LINE = {
    "max_uplift_mm": ("supports", "max_uplift_mm"),
    "n_slackened": ("droppers", "n_slackened"),
    "max_dropper_force_N": ("droppers", "max_force_N"),
    "min_dropper_force_N": ("droppers", "min_force_N"),
}


def evaluate(scenes: Sequence[Scene], pool: Pool[Any] | None = None) -> list[dict[str, Any]]:
    """The summary of each scene's run, in their order. Not collective.

    Parameters
    ----------
    scenes : as many as there are to be run: those that share a line march side by side, and those
        that follow each other are marched by one process
    pool : processes that share the runs, as ``workers`` gives them; this process if None

    Returns
    -------
    list of dict
        The content of ``summary.json`` of each; ``{"broke": sentence}`` of a run that ended early,
        or of a line that cannot hang.

    Raises
    ------
    Interrupted
        If a signal came to several processes.
    """
    if pool is None:
        return _summaries(scenes)
    size = max(1, -(-len(scenes) // pool.n))
    pieces = [scenes[at : at + size] for at in range(0, len(scenes), size)]
    found = [one for outcome in in_order(pool.of(pieces)) for one in outcome.get()]
    if len(found) < len(scenes):
        raise Interrupted("the study was interrupted; the same command continues it")
    return found


@contextmanager
def workers(n: int) -> Iterator[Pool[Any] | None]:
    """``n`` processes for ``evaluate``, 0 for one on each core; None for one. Not collective."""
    n = n or cores()
    if n == 1:
        yield None
        return
    with Pool(n, _summaries) as pool:
        yield pool


# Keeps the line of the latest scenes for those to come.
_marches: Marches | None = None


def _summaries(scenes: Sequence[Scene], comm: Any = None) -> list[dict[str, Any]]:
    from catenary.base.lone_process import alone
    from catenary.cases.process.petsc_options import options_of

    alone()  # starts MPI as one process, before anything imports it
    from catenary.cases.studies.ensemble import Marches
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


def values_of(summary: Mapping[str, Any], statistic: str) -> list[float] | None:
    """A statistic of every pantograph of a run, or the only one of its line.

    None if the run broke, or has no such statistic.

    Parameters
    ----------
    summary : of the run, as ``evaluate`` gives it
    statistic : one of ``STATISTICS`` of the tables of sweeps
    """
    if BROKE in summary:
        return None
    if statistic in OF_EACH_PANTOGRAPH:
        found = [one.get(statistic) for one in summary["pantographs"]]
    else:
        table, key = _OF_LINE[statistic]
        found = [summary[table].get(key)]
    return None if None in found else [float(value) for value in found]


Wanted = tuple[SceneSet, Member, Mapping[str, Any]]


class Evaluation:
    """Summaries of scenes, each run made once, and kept. Not collective.

    Parameters
    ----------
    pool : processes that share the runs, None for this one
    kept : where summaries are kept from one process to the next
    """

    def __init__(
        self,
        pool: Pool[Any] | None = None,
        kept: KeptRows | None = None,
    ) -> None:
        self._pool = pool
        self._kept = KeptRows(None) if kept is None else kept
        self._known: dict[str, dict[str, Any]] = {}
        #: Runs that were made or kept, each once.
        self.n_runs = 0

    def of(self, wanted: Sequence[Wanted]) -> list[dict[str, Any]]:
        """The summary of each wanted scene, run together unless it is known.

        Parameters
        ----------
        wanted : set, member of it and further values by dotted keys, for each scene

        Returns
        -------
        list of dict
            As ``evaluate`` gives them; a scene that cannot be made broke, too.
        """
        keys, new = [], {}
        for scenes, member, values in wanted:
            try:
                scene = scenes.scene(member, values)
            except InputError as error:
                key = f"{BROKE}: {error}"
                self._known[key] = {BROKE: str(error)}
            else:
                key = identity(scene)
                if key not in self._known and key not in new:
                    new[key] = scene
            keys.append(key)
        self._run(new)
        return [self._known[key] for key in keys]

    def _run(self, new: dict[str, Scene]) -> None:
        self.n_runs += len(new)  # those kept too, so that a study ends the same that was stopped
        for key in list(new):
            if (kept := self._kept.get(key)) is not None:
                self._known[key] = kept
                del new[key]
        if not new:
            return
        from catenary.cases.studies.ensemble import in_short

        for key, summary in zip(new, evaluate(list(new.values()), self._pool), strict=True):
            own = summary if BROKE in summary else in_short(summary)
            self._known[key] = own
            self._kept.keep(key, own)


def identity(scene: Scene) -> str:
    """A text that two scenes share if their figures are the same."""
    tables = resolved(scene)
    return json.dumps({k: v for k, v in tables.items() if k not in _IDLE}, sort_keys=True)
