"""Runs of scenes that are asked for again and again: each is made once."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

from catenary.base.errors import InputError
from catenary.cases.scene.problem import resolved
from catenary.cases.scene.scene import Scene
from catenary.cases.studies.records import KeptRows
from catenary.cases.studies.scene_sets.evaluate import BROKE, Workers, evaluate
from catenary.cases.studies.scene_sets.scene_set import Member, SceneSet

# Tables of a scene that its figures do not depend on.
_IDLE = ("case", "output", "test")
# What studies read of a summary, without tables of all supports.
_KEPT = ("pantographs", "droppers", "acceptance", BROKE)

Wanted = tuple[SceneSet, Member, Mapping[str, Any]]


class Evaluation:
    """Summaries of scenes, each run made once, and kept. Not collective.

    Parameters
    ----------
    workers : processes that share the runs, None for this one
    kept : where summaries are kept from one process to the next
    """

    def __init__(
        self,
        workers: Workers | None = None,
        kept: KeptRows | None = None,
    ) -> None:
        self._workers = workers
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
        for key, summary in zip(new, evaluate(list(new.values()), self._workers), strict=True):
            own = {name: summary[name] for name in _KEPT if name in summary}
            if BROKE not in own:
                own["supports"] = {"max_uplift_mm": summary["supports"]["max_uplift_mm"]}
            self._known[key] = own
            self._kept.keep(key, own)


def identity(scene: Scene) -> str:
    """A text that two scenes share if their figures are the same."""
    tables = resolved(scene)
    return json.dumps({k: v for k, v in tables.items() if k not in _IDLE}, sort_keys=True)
