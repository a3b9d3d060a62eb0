"""A sweep from its variants to its table."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

from catenary.base.errors import InputError
from catenary.base.options import option
from catenary.cases.result_folder.output_folder import (
    another_folder,
    force_option,
    refuse_earlier,
    refuse_impossible,
)
from catenary.cases.scene.input.faults import shown
from catenary.cases.scene.load import Draft
from catenary.cases.studies.sweep.jobs import (
    HISTORIES,
    Ended,
    Job,
    RunOptions,
    check_names,
    in_order,
    jobs_and_refused,
)
from catenary.cases.studies.sweep.same_scene import other_value
from catenary.cases.studies.sweep.variants import Variant

if TYPE_CHECKING:
    from catenary.cases.scene.scene import Scene
    from catenary.cases.studies.sweep.jobs import Part
    from catenary.cases.studies.sweep.together import Ensemble


class WholeRuns(NamedTuple):
    """Variants of a case, each of which leaves a run in a folder of its own.

    Attributes
    ----------
    draft : the case
    variants : in their order
    jobs : of those that can be run
    refused : how the others ended
    """

    draft: Draft
    variants: Sequence[Variant]
    jobs: list[Job]
    refused: list[Ended]

    @property
    def first(self) -> Scene:
        """The scene of the first variant that can be run."""
        return self.jobs[0].scene

    def run(
        self, out: Path, comm: Any, options: RunOptions, part: Part | None = None
    ) -> list[Ended]:
        """Run what is not done yet; returns how all variants ended, in their order. Collective.

        With a ``part`` only its variants are run and returned, without the refused ones.
        """
        from catenary.cases.studies.sweep.run_jobs import run_jobs

        if part is not None:
            return run_jobs(part.of(self.jobs), out, comm, options)
        return in_order(self.variants, run_jobs(self.jobs, out, comm, options), self.refused)


Sweep: TypeAlias = "WholeRuns | Ensemble"
"""Whole runs of variants, or an ensemble that keeps statistics alone."""


def sweep_of(
    draft: Draft,
    variants: Sequence[Variant],
    out: Path,
    *,
    full_report: bool = False,
    only_statistics: bool = False,
    histories: Sequence[str] = (),
    force: bool = False,
) -> Sweep:
    """A sweep of a case into a folder, all scenes checked. Not collective.

    Parameters
    ----------
    draft : of the case
    variants : of the sweep
    out : folder of the sweep
    full_report : whether each whole run gets a report
    only_statistics : whether it is an ensemble: there is no run of a variant on the disk, but for
        ``histories``, and scenes are checked when it is their turn
    histories : channels that an ensemble keeps over time
    force : whether a sweep with other variants there is replaced

    Raises
    ------
    InputError
        If one of ``histories`` is none, or whole runs are kept, which have them; as
        ``whole_runs_of``.
    """
    check_names(histories, HISTORIES, "history")
    if not only_statistics:
        if histories:
            raise InputError(
                f"{option('--histories', 'histories')} goes with "
                f"{option('--only-statistics', 'only_statistics')}: whole runs keep all in run.h5"
            )
        return whole_runs_of(draft, variants, out, full_report=full_report, force=force)
    from catenary.cases.studies.sweep.together import ensemble_of

    ensemble = ensemble_of(draft, variants, histories)
    refuse_other_sweep(out, variants, force, draft)
    return ensemble


def whole_runs_of(
    draft: Draft,
    variants: Sequence[Variant],
    out: Path,
    *,
    full_report: bool = False,
    force: bool = False,
) -> WholeRuns:
    """A sweep of ``variants`` of a case, ``draft``, into a folder ``out`` where they leave whole
    runs, with ``full_report`` a report of each. Not collective.

    Raises
    ------
    InputError
        As ``jobs_and_refused``, or if the folder has the table of a sweep with variants that this
        one has not, and ``force`` is not given.
    """
    runs = WholeRuns(draft, variants, *jobs_and_refused(draft, variants, full_report))
    refuse_other_sweep(out, variants, force)
    return runs


def run_sweep(
    sweep: Sweep,
    out: Path,
    comm: Any,
    options: RunOptions,
    command: str,
    plotted: Sequence[str] | None,
    histogram: bool = False,
) -> tuple[list[Ended], list[Path]]:
    """Run what is not done yet, and write table and picture. Collective.

    Parameters
    ----------
    command : work of this process in words, for others that want the folder
    plotted : statistics that are drawn; the usual ones if there are none, no picture of None
    histogram : whether histograms of the contact forces are written too

    Returns
    -------
    How all variants ended, in their order, and the files.
    """
    from catenary.base.parallel import on_root
    from catenary.cases.result_folder.folder_lock import held
    from catenary.cases.studies.sweep import output

    name, show, scene = sweep.first.case.name, plotted, sweep.draft.table()
    if show is not None:
        show = show or output.PLOTTED
    with held(out, comm, command):
        on_root(comm, lambda: refuse_earlier(out, options.force))
        ended = sweep.run(out, comm, options)
        files = on_root(
            comm, lambda: output.write(out, name, ended, show, histogram, scene), takes_long=True
        )
    if not isinstance(sweep, WholeRuns) and sweep.histories:
        files += [path for path in (out / "histories.h5",) if path.is_file()]
    return ended, files


def run_part(sweep: Sweep, part: Part, out: Path, comm: Any, options: RunOptions) -> list[Ended]:
    """Run a part of a sweep, as a task of a job array; returns how its variants ended. Collective.

    The part writes a table to a folder of its own, for ``catenary merge``. If parts share ``out``,
    the sweep run there after all of them writes the table of all variants.
    """
    from catenary.base.parallel import on_root
    from catenary.cases.studies.sweep import output

    ended = sweep.run(out, comm, options, part)
    name, folder, scene = sweep.first.case.name, out / part.folder, sweep.draft.table()
    on_root(comm, lambda: output.write(folder, name, ended, None, scene=scene), takes_long=True)
    return ended


def refuse_other_sweep(
    out: Path, variants: Sequence[Variant], force: bool, draft: Draft | None = None
) -> None:
    """Raise InputError if ``out`` has a table of another sweep, unless ``force``: of variants that
    this one has not, or that have other values here, or of another scene than that of ``draft``.

    Folders of whole runs are compared with the ``draft`` of each when it is their turn.
    """
    refuse_impossible(out)
    path = out / "sweep.json"
    if force or not path.is_file():
        return
    try:
        table = json.loads(path.read_text(encoding="utf-8"))
        there = {str(one["name"]): list(one["assignments"]) for one in table["variants"]}
        scene, varied = table.get("scene") or {}, [str(key) for key in table["varied"]]
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError):
        return
    here = {variant.name: list(variant.assignments) for variant in variants}
    replace = f"{another_folder()}, or give {force_option()} to replace it"
    if other := sorted(there.keys() - here.keys()):
        raise InputError(
            f"{path} is the table of a sweep with other variants ({other[0]}); {replace}"
        )
    if other := sorted(name for name, values in there.items() if values != here[name]):
        raise InputError(f"{path} is the table of a sweep with another {other[0]}; {replace}")
    if draft is None or not scene:
        return
    own = json.loads(json.dumps(draft.table(), default=str))
    if (differs := other_value(scene, own, varied)) is not None:
        key, value, wanted = differs
        raise InputError(
            f"{path} is the table of a sweep with {key} = {shown(value)}, here it is "
            f"{shown(wanted)}; {replace}"
        )
